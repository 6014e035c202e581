// Pages and their checksums, with files whose every byte is known.
#include "core/e57/paged_bytes.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "absl/strings/match.h"
#include "tests/support/e57_writer.h"

namespace vantage::e57 {
namespace {

// A header, and then bytes that tell where they are.
std::string Numbered(size_t size, size_t page) {
  std::string logical = "ASTM-E57";
  logical.resize(48);
  logical[8] = 1;
  logical[24] = 48;  // the description, of no bytes
  for (size_t i = logical.size(); i < size; ++i) logical.push_back(static_cast<char>(i % 251));
  return test_support::PagesOf(logical, page);
}

TEST(PagedBytes, AreThoseBetweenTheChecksums) {
  for (const size_t page : {64u, 1024u, 4096u}) {
    const std::string file = Numbered(5000, page);
    absl::StatusOr<PagedBytes> paged = PagedBytes::Open(file);
    ASSERT_TRUE(paged.ok()) << paged.status();
    EXPECT_EQ(paged->size(), file.size() / page * (page - 4));
    std::string read(4900, '\0');
    ASSERT_TRUE(paged->Read(100, read.size(), read.data()).ok());
    for (size_t i = 0; i < read.size(); ++i) {
      ASSERT_EQ(read[i], static_cast<char>((100 + i) % 251)) << i;
    }
    // A place in the file is that of the same byte.
    for (const uint64_t at : {uint64_t{50}, uint64_t{page}, uint64_t{page} + 7}) {
      char byte = 0;
      ASSERT_TRUE(paged->Read(paged->Logical(at).value(), 1, &byte).ok());
      EXPECT_EQ(byte, file[at]);
    }
    EXPECT_FALSE(paged->Logical(page - 1).ok()) << "a checksum";
    EXPECT_FALSE(paged->Logical(file.size()).ok());
    EXPECT_TRUE(absl::IsInvalidArgument(paged->Read(paged->size() - 3, 4, read.data())));
    EXPECT_TRUE(absl::IsInvalidArgument(paged->Read(~uint64_t{0}, 4, read.data())));
  }
}

TEST(PagedBytes, ADamagedPageIsNotRead) {
  std::string file = Numbered(5000, 1024);
  file[2 * 1024 + 17] ^= 1;
  absl::StatusOr<PagedBytes> paged = PagedBytes::Open(file);
  ASSERT_TRUE(paged.ok()) << paged.status();
  char byte = 0;
  EXPECT_TRUE(paged->Read(2 * 1020 - 1, 1, &byte).ok());
  EXPECT_TRUE(paged->Read(3 * 1020, 1, &byte).ok());
  const absl::Status damaged = paged->Read(2 * 1020 + 900, 1, &byte);
  EXPECT_TRUE(absl::IsDataLoss(damaged)) << damaged;
  EXPECT_TRUE(absl::StrContains(damaged.message(), "2048")) << damaged;
}

TEST(PagedBytes, WhatIsNoE57IsRefused) {
  const std::string good = Numbered(5000, 1024);
  const auto with = [&](size_t at, uint64_t value) {
    std::string file = good;
    std::memcpy(file.data() + at, &value, sizeof(value));
    return file;
  };
  for (const std::string& file :
       {std::string(), std::string("ASTM-E5"), good.substr(0, 40), good.substr(0, 3 * 1024),
        good + std::string(1024, '\0'), with(0, 0), with(40, 0), with(40, 1000),
        with(40, uint64_t{1} << 40), with(24, good.size() + 1), with(32, uint64_t{1} << 62)}) {
    EXPECT_TRUE(absl::IsInvalidArgument(PagedBytes::Open(file).status()))
        << PagedBytes::Open(file).status();
  }
  EXPECT_TRUE(absl::IsUnimplemented(PagedBytes::Open(with(8, 2)).status()));
}

}  // namespace
}  // namespace vantage::e57
