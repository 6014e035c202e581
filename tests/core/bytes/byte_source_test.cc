// A file, read piece by piece, beside the same bytes in memory.
#include "core/bytes/byte_source.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/bytes/text_scanner.h"

namespace vantage::bytes {
namespace {

class ByteSourceTest : public ::testing::Test {
 protected:
  ~ByteSourceTest() override { std::filesystem::remove(path_); }
  ByteSource Written(const std::string& bytes) {
    std::ofstream(path_, std::ios::binary) << bytes;
    return ByteSource::Open(path_).value();
  }
  const std::string path_ =
      (std::filesystem::temp_directory_path() / absl::StrCat("byte_source_test_", getpid()));
};

std::string Random(size_t size, uint32_t seed) {
  std::mt19937 random(seed);
  std::string bytes(size, '\0');
  for (char& c : bytes) c = static_cast<char>(random());
  return bytes;
}

TEST_F(ByteSourceTest, AnyPlaceOfAFileIsAsInMemory) {
  const std::string bytes = Random(9 << 20, 1);  // two windows and a part of one
  ByteSource file = Written(bytes);
  ASSERT_EQ(file.size(), bytes.size());
  EXPECT_EQ(file.All().value(), bytes);
  std::mt19937 random(2);
  for (int i = 0; i < 300; ++i) {
    const size_t begin = random() % bytes.size();
    const size_t size = random() % std::min<size_t>(bytes.size() - begin + 1, 6 << 20);
    ASSERT_EQ(file.View(begin, size).value(), absl::string_view(bytes).substr(begin, size));
    ByteSource part = file.Part(begin, size);
    ASSERT_EQ(part.size(), size);
    const size_t within = size == 0 ? 0 : random() % size;
    ASSERT_EQ(part.View(within, size - within).value(),
              absl::string_view(bytes).substr(begin + within, size - within));
    ASSERT_EQ(ByteSource(bytes).Part(begin, size).All().value(), bytes.substr(begin, size));
  }
}

TEST_F(ByteSourceTest, LinesOfAFileAreThoseInMemory) {
  std::mt19937 random(3);
  std::string text;
  for (int i = 0; i < 4000; ++i) {
    text += std::string(random() % (i % 500 == 0 ? 3 << 20 : 900), 'x');  // some beyond a window
    text += i % 3 == 0 ? "\r\n" : "\n";
  }
  text += "the last one has no end";
  TextScanner file(Written(text));
  TextScanner memory{ByteSource(text)};
  absl::string_view of_file;
  absl::string_view of_memory;
  while (memory.NextLine(of_memory)) {
    ASSERT_TRUE(file.NextLine(of_file));
    ASSERT_EQ(of_file, of_memory) << memory.line_number();
    ASSERT_EQ(file.offset(), memory.offset());
    ASSERT_EQ(file.line_number(), memory.line_number());
  }
  EXPECT_FALSE(file.NextLine(of_file));
}

TEST_F(ByteSourceTest, WhatIsNoFileIsRefusedAndAFileThatShrinksIsNoticed) {
  EXPECT_TRUE(absl::IsNotFound(ByteSource::Open(path_).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(
      ByteSource::Open(std::filesystem::temp_directory_path().string()).status()));
  ByteSource file = Written(Random(9 << 20, 4));
  ASSERT_TRUE(file.View(0, 10).ok());
  std::filesystem::resize_file(path_, 5 << 20);
  EXPECT_TRUE(absl::IsDataLoss(file.View(8 << 20, 10).status()));
  EXPECT_TRUE(absl::IsDataLoss(file.All().status()));
  TextScanner text(file);
  absl::string_view line;
  while (text.NextLine(line)) {
  }
  EXPECT_TRUE(absl::IsDataLoss(text.status())) << "no end of the text";
}

}  // namespace
}  // namespace vantage::bytes
