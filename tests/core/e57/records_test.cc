// Records of every kind of number, spread over packets at random, are read as they were written.
#include "core/e57/records.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "tests/support/e57_writer.h"

namespace vantage::e57 {
namespace {

using test_support::E57Doubles;
using test_support::E57Floats;
using test_support::E57Integers;
using test_support::E57Options;
using test_support::E57Scaled;
using test_support::E57SetupFile;
using test_support::E57Texts;
using test_support::WriteE57;

// All values of the fields, in order.
absl::StatusOr<std::vector<std::vector<double>>> ReadAll(const std::string& bytes,
                                                         const std::vector<size_t>& fields) {
  absl::StatusOr<PagedBytes> file = PagedBytes::Open(bytes);
  if (!file.ok()) return file.status();
  const absl::StatusOr<std::vector<ScanSetup>> setups = ReadIndex(*file);
  if (!setups.ok()) return setups.status();
  std::vector<std::vector<double>> all(fields.size());
  const absl::Status read =
      ReadRecords(*file, setups->back(), fields, [&](RecordBlock block) -> absl::Status {
        for (size_t f = 0; f < fields.size(); ++f) {
          EXPECT_EQ(block[f].size(), block[0].size());
          all[f].insert(all[f].end(), block[f].begin(), block[f].end());
        }
        return absl::OkStatus();
      });
  if (!read.ok()) return read;
  return all;
}

TEST(Records, IntegersOfEveryWidth) {
  std::mt19937_64 random(5);
  for (int bits = 0; bits <= 64; ++bits) {
    const uint64_t span = bits == 64 ? ~uint64_t{0} : (uint64_t{1} << bits) - 1;
    // Not more than the largest number there is.
    const auto minimum =
        bits == 64 ? std::numeric_limits<int64_t>::min() : -static_cast<int64_t>(span / 2);
    const auto maximum = static_cast<int64_t>(static_cast<uint64_t>(minimum) + span);
    std::vector<int64_t> values;
    values.reserve(500);
    for (int i = 0; i < 500; ++i) {
      values.push_back(static_cast<int64_t>(static_cast<uint64_t>(minimum) + (random() & span)));
    }
    values[3] = minimum;
    values[4] = maximum;
    E57SetupFile setup;
    setup.streams = {E57Integers("timeStamp", minimum, maximum, values)};
    setup.records = values.size();
    for (const size_t packets : {1u, 7u}) {
      E57Options options;
      options.packets = packets;
      const auto read = ReadAll(WriteE57({setup}, options), {0});
      ASSERT_TRUE(read.ok()) << read.status();
      ASSERT_EQ((*read)[0].size(), values.size());
      for (size_t i = 0; i < values.size(); ++i) {
        ASSERT_EQ((*read)[0][i], static_cast<double>(values[i])) << bits << " bits, record " << i;
      }
    }
  }
}

// Texts, whose sizes differ, lie between them; index packets and ignored packets too.
TEST(Records, EveryKindOfNumberSideBySide) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> metres(-30, 30);
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> z;
  std::vector<int64_t> row;
  std::vector<std::string> text;
  for (int i = 0; i < 900; ++i) {
    x.push_back(metres(random));
    y.push_back(static_cast<double>(static_cast<float>(metres(random))));
    z.push_back(std::round(metres(random) * 1e5) / 1e5 + 0.5);
    row.push_back(i % 700);
    text.push_back(std::string(static_cast<size_t>(i % 300), 't'));
  }
  E57SetupFile setup;
  setup.streams = {E57Doubles("cartesianX", x), E57Texts("nor:note", text),
                   E57Floats("cartesianY", y), E57Integers("rowIndex", 0, 2047, row),
                   E57Scaled("cartesianZ", 1e-5, 0.5, -5'000'000, 5'000'000, z)};
  setup.records = x.size();
  for (const size_t page : {64u, 1024u}) {
    E57Options options;
    options.page = page;
    options.packets = 11;
    options.others = true;
    const auto read = ReadAll(WriteE57({setup}, options), {3, 4, 0, 2});
    ASSERT_TRUE(read.ok()) << read.status();
    ASSERT_EQ((*read)[0].size(), x.size());
    EXPECT_EQ((*read)[2], x);
    EXPECT_EQ((*read)[3], y);
    for (size_t i = 0; i < x.size(); ++i) {
      ASSERT_EQ((*read)[0][i], static_cast<double>(row[i]));
      ASSERT_NEAR((*read)[1][i], z[i], 1e-12);
    }
  }
}

TEST(Records, OfThoseThatTakeNoBitsThereAreAsManyAsStated) {
  E57SetupFile setup;
  setup.streams = {E57Integers("rowIndex", 7, 7, std::vector<int64_t>(3, 7))};
  setup.records = 200'000;
  const auto read = ReadAll(WriteE57({setup}), {0});
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ((*read)[0], std::vector<double>(200'000, 7));
}

TEST(Records, AnErrorOfWhoTakesThemEndsIt) {
  E57SetupFile setup;
  setup.streams = {E57Integers("rowIndex", 0, 1, {1, 0, 1})};
  setup.records = 3;
  const std::string bytes = WriteE57({setup});
  PagedBytes file = PagedBytes::Open(bytes).value();
  const std::vector<ScanSetup> setups = ReadIndex(file).value();
  const std::vector<size_t> fields{0};
  EXPECT_EQ(ReadRecords(file, setups[0], fields,
                        [](RecordBlock) { return absl::AbortedError("enough"); }),
            absl::AbortedError("enough"));
}

// What ends early, or is not what it says, is told with the record where.
TEST(Records, SectionsThatAreNotWhatTheySayAreRefused) {
  E57SetupFile setup;
  setup.head = "<name type=\"String\">hall</name>";
  setup.streams = {E57Integers("rowIndex", 0, 255, std::vector<int64_t>(100, 9))};
  setup.records = 101;
  const absl::Status ends = ReadAll(WriteE57({setup}), {0}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(ends)) << ends;
  EXPECT_TRUE(absl::StrContains(ends.message(), "set-up hall, record 100 of 101")) << ends;
  setup.records = 100;
  const std::string good = WriteE57({setup});
  ASSERT_TRUE(ReadAll(good, {0}).ok());
  // Bytes of the section: its kind; its length; where its data begin; a packet's kind, its length,
  // the number of its fields, the length of one.
  for (const size_t at : {48u, 48u + 15, 48u + 23, 80u, 80u + 3, 80u + 4, 80u + 7}) {
    std::string logical;
    for (size_t page = 0; page < good.size(); page += 1024) logical += good.substr(page, 1020);
    logical[at] = static_cast<char>(logical[at] ^ 0x41);
    const absl::Status bad = ReadAll(test_support::PagesOf(logical), {0}).status();
    EXPECT_TRUE(absl::IsInvalidArgument(bad)) << at << ": " << bad;
  }
}

}  // namespace
}  // namespace vantage::e57
