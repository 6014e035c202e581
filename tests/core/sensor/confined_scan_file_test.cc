#include "core/sensor/confined_scan_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/sensor/encoding.h"
#include "core/sensor/scan_answer.h"
#include "tests/core/sensor/analytic_room.h"
#include "tests/core/sensor/read_both_ways.h"
#include "tests/support/scan_files.h"

namespace vantage::sensor {
namespace {

namespace fs = std::filesystem;

// A room of `columns` x 20 cells with holes, as an image.
RangeImage HoledRoom(int columns, uint32_t seed) {
  std::mt19937 random(seed);
  RangeImage image;
  image.azimuth = Evenly(-3.1, 2 * kPi / columns, static_cast<size_t>(columns));
  image.elevation = Evenly(Radians(-50), Radians(6), 20);
  image.native_azimuth_step = 2 * kPi / columns;
  image.native_elevation_step = Radians(6);
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < 20; ++row) {
      const Eigen::Vector3d ray = image.Direction(column, row);
      image.range.push_back(random() % 7 == 0 ? RangeImage::kNoReturn
                                              : static_cast<float>(RoomRange(ray)));
    }
  }
  return image;
}

std::string XyzOf(const RangeImage& image) {
  std::ostringstream text;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const Eigen::Vector3d point = image.at(column, row) * image.Direction(column, row);
      if (RangeImage::IsRange(image.at(column, row))) text << point.transpose() << "\n";
    }
  }
  return text.str();
}

class ConfinedScanFileTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::string Write(const std::string& name, const std::string& bytes) const {
    std::string path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  const fs::path folder_ =
      fs::temp_directory_path() / ("confined_scan_file_test_" + std::to_string(getpid()));
};

// Whole files, and the same with bytes that were damaged or cut off at random, most of which are
// refused for a hundred reasons.
TEST_F(ConfinedScanFileTest, SaysWhatAReaderInThisProcessSays) {
  std::mt19937 random(7);
  size_t read = 0;
  size_t refused = 0;
  for (uint32_t seed = 0; seed < 3; ++seed) {
    const RangeImage image = HoledRoom(40 + static_cast<int>(seed), seed);
    const std::string ptx = test_support::PtxOf(image);
    const std::vector<std::pair<std::string, std::string>> files = {
        {"room.e57", test_support::E57Of(image)},
        {"room.ptx", ptx},
        {"two.ptx", ptx + ptx},
        {"room.vrim", EncodeRangeImage(image)},
        {"room.xyz", XyzOf(image)}};
    for (const auto& [name, whole] : files) {
      std::optional<Eigen::Vector3d> station;
      if (name == "room.xyz") station.emplace(0, 0, 0);
      for (int times = 0; times < 5; ++times) {
        std::string bytes = whole;
        if (times == 1) bytes.resize(random() % bytes.size());
        if (times > 1) bytes[random() % bytes.size()] = static_cast<char>(random());
        for (const auto& scan : ReadBothWays(Write(name, bytes), station)) {
          ++(scan.ok() ? read : refused);
        }
      }
    }
  }
  EXPECT_GT(read, 20u);
  EXPECT_GT(refused, 10u);
}

TEST_F(ConfinedScanFileTest, SaysOfFilesThatAreNotReadWhatAReaderInThisProcessSays) {
  ReadBothWays((folder_ / "nothing.e57").string());
  ReadBothWays(folder_.string() + ".ptx");
  ReadBothWays(Write("scan.laz", "LASF"));
  ReadBothWays(Write("scan.xyz", "1 2 3\n"));                        // no station
  ReadBothWays(Write("scan.ptx", "2\n"), Eigen::Vector3d(0, 0, 0));  // one too many
  ReadBothWays(Write("empty.e57", ""));
}

TEST_F(ConfinedScanFileTest, RealFilesAreTheSame) {
  const char* shared = std::getenv("VANTAGE_SHARED_DATA");
  if (shared == nullptr || !fs::exists(shared)) {
    GTEST_SKIP() << "set VANTAGE_SHARED_DATA to the folder with e57_files";
  }
  size_t read = 0;
  for (const auto& entry : fs::recursive_directory_iterator(shared)) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".e57" && ending != ".ptx" && ending != ".pcd") continue;
    ImportLimits limits;
    limits.appearance = {true, true};
    for (const auto& scan : ReadBothWays(entry.path().string(), {}, limits)) read += scan.ok();
  }
  EXPECT_GE(read, 4u);
}

// A reader that is gone is started anew; a file that has changed meanwhile is not taken for the
// same.
TEST_F(ConfinedScanFileTest, MemoryIsBoundedAndTheNextSetUpIsReadAllTheSame) {
  const std::string ptx = test_support::PtxOf(HoledRoom(20'000, 1));
  const std::string path = Write("large.ptx", ptx + test_support::PtxOf(HoledRoom(40, 2)));
  confinement::AllowanceSettings little;
  little.memory_mb = 8;  // what it reads at a time, twice
  absl::StatusOr<ConfinedScanFile> file = ConfinedScanFile::Open(path, {}, little);
  ASSERT_TRUE(file.ok()) << file.status();
  const absl::Status status = file->Read(0, {}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()),
              testing::AllOf(testing::StartsWith(path + ": its reader needs more than 8 MB"),
                             testing::HasSubstr("--reader-memory")));
  const absl::StatusOr<ImportedScan> next = file->Read(1, {});
  EXPECT_TRUE(next.ok()) << next.status();
  EXPECT_FALSE(file->Read(0, {}).ok());
  Write("large.ptx", ptx);
  EXPECT_THAT(std::string(file->Read(0, {}).status().message()), testing::HasSubstr("has changed"));
}

// ---- What is received.

std::string Said(const ImportedScan& scan) {
  std::string bytes;
  SayScan(scan, [&](absl::string_view part) { bytes.append(part.data(), part.size()); });
  return bytes;
}

absl::StatusOr<ImportedScan> Heard(const std::string& bytes, uint64_t max_bytes) {
  size_t at = 0;
  return HearScan(
      [&](char* to, size_t size) {
        if (size > bytes.size() - at) return absl::OutOfRangeError("it ends early");
        std::copy_n(bytes.data() + at, size, to);
        at += size;
        return absl::OkStatus();
      },
      max_bytes);
}

ImportedScan SomeScan() {
  ImportedScan scan = ImportImage(HoledRoom(40, 3), {});
  scan.T_world_scan = Eigen::Isometry3d(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
  scan.duplicates = 5;
  scan.apart = 0.25;
  scan.loose = scan.leaning = true;
  scan.scanner.name = "of a file";
  scan.image.appearance.intensity.assign(scan.image.cells(), 7);
  scan.image.appearance.colour.assign(scan.image.cells(), {1, 2, 3});
  return scan;
}

TEST(ScanAnswerTest, IsHeardAsItWasSaid) {
  const ImportedScan scan = SomeScan();
  const std::string bytes = Said(scan);
  const absl::StatusOr<ImportedScan> heard = Heard(bytes, bytes.size());
  ASSERT_TRUE(heard.ok()) << heard.status();
  ExpectSameScan(*heard, scan);
  for (size_t size = 0; size < bytes.size(); size += 97) {
    EXPECT_EQ(Heard(bytes.substr(0, size), bytes.size()).status().code(),
              absl::StatusCode::kOutOfRange);
  }
  EXPECT_EQ(Heard(bytes, bytes.size() / 2).status().code(), absl::StatusCode::kInvalidArgument);
}

// Whatever arrives, what is taken of it is what a reader could have said.
TEST(ScanAnswerTest, WhatIsHeardMakesSense) {
  const std::string bytes = Said(SomeScan());
  std::mt19937 random(11);
  size_t taken = 0;
  for (int times = 0; times < 3000; ++times) {
    std::string damaged = bytes;
    // Half of the damage where everything has a meaning of its own.
    const size_t where = random() % (times % 2 == 0 ? 300 : damaged.size());
    for (size_t i = 0; i <= random() % 8; ++i) {
      damaged[std::min(where + i, damaged.size() - 1)] = static_cast<char>(random());
    }
    const absl::StatusOr<ImportedScan> heard = Heard(damaged, 2 * bytes.size());
    if (!heard.ok()) continue;
    ++taken;
    ASSERT_TRUE(heard->image.Validate().ok());
    ASSERT_LE(heard->duplicates, heard->points);
    ASSERT_LE(heard->far, heard->points);
    ASSERT_TRUE(heard->apart >= 0 && heard->apart <= 1);
    if (heard->T_world_scan) {
      ASSERT_NEAR(heard->T_world_scan->linear().determinant(), 1, 1e-5);
    }
    // There is one way to say each; what was not heard does not count.
    const std::string again = Said(*heard);
    ASSERT_EQ(again, damaged.substr(0, again.size()));
  }
  EXPECT_GT(taken, 100u);
}

TEST(SetupsAnswerTest, IsHeardAsItWasSaid) {
  const std::vector<std::string> setups = {"one", "", "three"};
  std::string bytes;
  SaySetups(setups, [&](absl::string_view part) { bytes.append(part.data(), part.size()); });
  const auto heard = [&](const std::string& said, uint64_t max_bytes) {
    size_t at = 0;
    return HearSetups(
        [&](char* to, size_t size) {
          if (size > said.size() - at) return absl::OutOfRangeError("it ends early");
          std::copy_n(said.data() + at, size, to);
          at += size;
          return absl::OkStatus();
        },
        max_bytes);
  };
  EXPECT_EQ(heard(bytes, 1000).value(), setups);
  EXPECT_FALSE(heard(bytes.substr(0, bytes.size() - 1), 1000).ok());
  EXPECT_FALSE(heard(bytes, 10).ok());
  EXPECT_FALSE(heard(std::string(8, '\0'), 1000).ok());
  EXPECT_FALSE(heard(std::string(8, '\xff'), 1000).ok());
}

}  // namespace
}  // namespace vantage::sensor
