#include "core/bytes/lzf.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lzf.h>

#include <random>
#include <string>

namespace vantage::bytes {
namespace {

using ::testing::HasSubstr;

std::string Refusal(absl::string_view block, size_t size) {
  const absl::Status status = DecompressLzf(block, size).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
  return std::string(status.message());
}

TEST(LzfTest, RefusesWhatDoesNotFit) {
  EXPECT_EQ(*DecompressLzf(std::string("\2abc\x20\2", 6), 6), "abcabc");
  EXPECT_EQ(*DecompressLzf("", 0), "");
  EXPECT_EQ(Refusal("", 1), "LZF data unpack to 0 bytes where 1 were announced");
  // Before the beginning.
  EXPECT_THAT(Refusal(std::string("\2abc\x20\3", 6), 6), HasSubstr("damaged LZF data"));
  // Beyond the end.
  EXPECT_EQ(Refusal(std::string("\2abc\x20\2", 6), 5),
            "damaged LZF data: more than the 5 bytes announced");
  EXPECT_THAT(Refusal(std::string("\2abc", 4), 0), HasSubstr("damaged LZF data"));
  // Too short.
  EXPECT_EQ(Refusal(std::string("\2abc\x20\2", 6), 7),
            "LZF data unpack to 6 bytes where 7 were announced");
  // Cut in a literal, and in references.
  EXPECT_THAT(Refusal(std::string("\2ab", 3), 3), HasSubstr("damaged LZF data"));
  EXPECT_THAT(Refusal(std::string("\0a\x20", 3), 4), HasSubstr("damaged LZF data"));
  EXPECT_THAT(Refusal(std::string("\0a\xE0", 3), 12), HasSubstr("damaged LZF data"));
  EXPECT_THAT(Refusal(std::string("\0a\xE0\1", 4), 11), HasSubstr("damaged LZF data"));
  // Could never unpack to that: nothing is allocated.
  EXPECT_EQ(Refusal(std::string("\0a", 2), 4'000'000'000),
            "LZF data of 2 bytes cannot unpack to 4000000000 bytes");
  EXPECT_EQ(Refusal(std::string("\0a", 2), size_t{1} << 40),
            "LZF data of 2 bytes cannot unpack to 1099511627776 bytes");
}

TEST(LzfTest, UnpacksWhatWasPackedAndNothingShorter) {
  std::mt19937 random(11);
  std::string bytes(20'000, '\0');
  // Runs of all lengths, so that references overlap what they write.
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = i > 0 && random() % 8 != 0 ? bytes[i - 1] : static_cast<char>(random() % 5);
  }
  std::string block(bytes.size(), '\0');
  block.resize(lzf_compress(bytes.data(), static_cast<unsigned int>(bytes.size()), block.data(),
                            static_cast<unsigned int>(block.size())));
  ASSERT_GT(block.size(), 0u);
  EXPECT_EQ(DecompressLzf(block, bytes.size()).value(), bytes);
  EXPECT_FALSE(DecompressLzf(block, bytes.size() - 1).ok());
  EXPECT_FALSE(DecompressLzf(block, bytes.size() + 1).ok());
  for (size_t size = 0; size < block.size(); size += 7) {
    EXPECT_FALSE(DecompressLzf(absl::string_view(block).substr(0, size), bytes.size()).ok());
  }
}

// Every block is unpacked or refused, never worse; the address sanitizer watches.
TEST(LzfTest, SurvivesNoise) {
  std::mt19937 random(5);
  int unpacked = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string block(random() % 24, '\0');
    for (char& c : block) c = static_cast<char>(random() % 4 == 0 ? random() : random() % 4);
    unpacked += DecompressLzf(block, random() % 12).ok() ? 1 : 0;
  }
  EXPECT_GT(unpacked, 100);
}

}  // namespace
}  // namespace vantage::bytes
