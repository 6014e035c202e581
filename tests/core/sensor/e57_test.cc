// Scans from E57, against closed form ranges and the same scans as PTX; what exporters write that
// the standard allows, or that it does not.
#include "core/sensor/e57.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "core/sensor/ptx.h"
#include "core/sensor/scan_file.h"
#include "tests/core/sensor/analytic_room.h"
#include "tests/support/e57_writer.h"

namespace vantage::sensor {
namespace {

using test_support::E57Bounds;
using test_support::E57Doubles;
using test_support::E57Floats;
using test_support::E57Integers;
using test_support::E57Options;
using test_support::E57Pose;
using test_support::E57Scaled;
using test_support::E57SetupFile;
using test_support::E57Stream;
using test_support::E57Texts;
using test_support::WriteE57;

constexpr size_t kColumns = 40;
constexpr size_t kRows = 20;

// A grid of 40 x 20 cells, of which a ninth has no return; its records, one for each return, told
// field by field so that a test can change them.
struct RoomRecords {
  std::vector<double> azimuth = Evenly(-3.1, 2 * kPi / 40, kColumns);
  std::vector<double> elevation = Evenly(Radians(-50), Radians(6), kRows);
  std::vector<Eigen::Vector3d> points =
      ScanRoom(azimuth, elevation, [](size_t c, size_t r) { return (c + r) % 9 != 0; });
  std::vector<double> x, y, z, range, turn, rise;
  std::vector<int64_t> row, column;

  RoomRecords() {
    for (size_t i = 0; i < points.size(); ++i) {
      if (!points[i].isZero(0)) Add(points[i], i / kRows, i % kRows);
    }
  }
  void Add(const Eigen::Vector3d& p, size_t of_column, size_t of_row) {
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
    range.push_back(p.norm());
    turn.push_back(std::atan2(p.y(), p.x()));
    rise.push_back(p.norm() > 0 ? std::asin(p.z() / p.norm()) : 0);
    column.push_back(static_cast<int64_t>(of_column));
    row.push_back(static_cast<int64_t>(of_row));
  }
  size_t size() const { return x.size(); }

  std::vector<E57Stream> Cartesian() const {
    return {E57Doubles("cartesianX", x), E57Doubles("cartesianY", y), E57Doubles("cartesianZ", z)};
  }
  std::vector<E57Stream> Spherical() const {
    return {E57Doubles("sphericalRange", range), E57Doubles("sphericalAzimuth", turn),
            E57Doubles("sphericalElevation", rise)};
  }
  // The prototype says 2,048 x 512, as one real exporter does.
  std::vector<E57Stream> Indices() const {
    return {E57Integers("rowIndex", 0, 2047, row), E57Integers("columnIndex", 0, 511, column)};
  }
  E57SetupFile Setup(std::vector<E57Stream> streams, const std::string& head = "") const {
    return {head, std::move(streams), size(), ""};
  }
};

std::vector<E57Stream> Both(std::vector<E57Stream> a, const std::vector<E57Stream>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class E57Test : public testing::Test {
 protected:
  static absl::StatusOr<ImportedScan> Parse(const E57SetupFile& setup,
                                            const E57Options& options = {}) {
    return ParseE57(WriteE57({setup}, options), 0, {});
  }
  void ExpectTheRoom(const E57SetupFile& setup, double ranges = 1e-5) const {
    const absl::StatusOr<ImportedScan> scan = Parse(setup);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_FALSE(scan->resampled);
    ExpectSameImage(scan->image, ptx_.image, 2e-5, ranges);
  }

  RoomRecords room_;
  const ImportedScan ptx_ = ParsePtx(PtxText(kColumns, kRows, room_.points), {}).value();
};

TEST_F(E57Test, AllFormsOfTheSameScanGiveTheSameImage) {
  const auto setup = [&](const std::vector<E57Stream>& points) {
    return room_.Setup(Both(points, room_.Indices()));
  };
  ExpectTheRoom(setup(room_.Cartesian()));
  ExpectTheRoom(setup(room_.Spherical()));
  ExpectTheRoom(setup({E57Floats("cartesianX", room_.x), E57Floats("cartesianY", room_.y),
                       E57Floats("cartesianZ", room_.z)}));
  constexpr int64_t kMost = 1 << 23;
  for (const double scale : {1e-6, 1e-5}) {
    ExpectTheRoom(setup({E57Scaled("cartesianX", scale, 0, -kMost, kMost, room_.x),
                         E57Scaled("cartesianY", scale, 0, -kMost, kMost, room_.y),
                         E57Scaled("cartesianZ", scale, 1.5, -kMost, kMost, room_.z)}),
                  2 * scale + 1e-5);
  }
  // Cartesian coordinates come before others; texts and extensions do not matter.
  ExpectTheRoom(setup(Both({E57Doubles("sphericalRange", std::vector<double>(room_.size(), 9)),
                            E57Doubles("nor:normalX", room_.x),
                            E57Texts("ext:note", std::vector<std::string>(room_.size(), "no"))},
                           room_.Cartesian())));
}

TEST_F(E57Test, WithoutIndicesTheDirectionsAreTheGrid) {
  ExpectTheRoom(room_.Setup(room_.Cartesian()));
  ExpectTheRoom(room_.Setup(room_.Spherical()));
}

TEST_F(E57Test, TheGridIsAsLargeAsIndexBoundsSay) {
  // Two rows below and three columns beside are known to be there: rays that nothing returned.
  const auto with = [&](const std::string& bounds) {
    return Parse(room_.Setup(Both(room_.Cartesian(), room_.Indices()), bounds));
  };
  const auto larger = with(E57Bounds(-2, 19, 0, 39));
  ASSERT_TRUE(larger.ok()) << larger.status();
  EXPECT_EQ(larger->image.rows(), 22);
  EXPECT_EQ(larger->image.columns(), 40);
  EXPECT_EQ(larger->image.SampleCount(), ptx_.image.SampleCount());
  // Bounds that leave out records are wrong, and the records right.
  const auto smaller = with(E57Bounds(5, 10, 3, 4));
  ASSERT_TRUE(smaller.ok()) << smaller.status();
  ExpectSameImage(smaller->image, ptx_.image);
  const absl::Status huge = with(E57Bounds(0, 1 << 20, 0, 1 << 20)).status();
  EXPECT_TRUE(absl::IsInvalidArgument(huge)) << huge;
  EXPECT_TRUE(absl::StrContains(huge.message(), "1048577 columns x 1048577 rows")) << huge;
}

// Cells without a return as each exporter writes them: none of these differs from one whose record
// is absent.
TEST_F(E57Test, AllWaysToSayThatNothingReturned) {
  const Eigen::Vector3d junk(1, 2, 0.5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Way {
    const char* name;
    Eigen::Vector3d point;
    int64_t state;
  };
  for (const Way& way : {Way{"direction only", junk, 1}, Way{"invalid", junk, 2},
                         Way{"unflagged zero", Eigen::Vector3d::Zero(), 0},
                         Way{"not a number", {nan, nan, nan}, 0}}) {
    RoomRecords room;
    std::vector<int64_t> state(room.size(), 0);
    for (size_t i = 0; i < room.points.size(); ++i) {
      if (!room.points[i].isZero(0)) continue;
      room.Add(way.point, i / kRows, i % kRows);
      state.push_back(way.state);
    }
    const std::vector<double> as_float(state.begin(), state.end());
    std::vector<E57Stream> points = Both(room.Cartesian(), room.Indices());
    if (way.state == 0) ExpectTheRoom(room.Setup(points));  // no state is stated at all
    for (const E57Stream& states : {E57Integers("cartesianInvalidState", 0, 2, state),
                                    E57Floats("cartesianInvalidState", as_float)}) {
      SCOPED_TRACE(way.name);
      ExpectTheRoom(room.Setup(Both(points, {states})));
    }
    if (way.state == 0) continue;
    ExpectTheRoom(room.Setup(Both(Both(room.Spherical(), room.Indices()),
                                  {E57Integers("sphericalInvalidState", 0, 2, state)})));
  }
}

TEST_F(E57Test, OfSeveralReturnsOfARayTheFirstCounts) {
  std::vector<int64_t> number(room_.size(), 0);
  const size_t once = room_.size();
  for (size_t i = 0; i < once; i += 5) {
    const Eigen::Vector3d behind = 1.3 * Eigen::Vector3d(room_.x[i], room_.y[i], room_.z[i]);
    room_.Add(behind, static_cast<size_t>(room_.column[i]), static_cast<size_t>(room_.row[i]));
    number.push_back(1);
  }
  const auto scan = Parse(room_.Setup(
      Both(Both(room_.Cartesian(), room_.Indices()), {E57Integers("returnIndex", 0, 3, number)})));
  ASSERT_TRUE(scan.ok()) << scan.status();
  ExpectSameImage(scan->image, ptx_.image);
  EXPECT_EQ(scan->duplicates, room_.size() - once);
}

// Some instruments count azimuths from 0 down to -2 pi, or beyond pi.
TEST_F(E57Test, AzimuthsMayBeCountedFromAnywhere) {
  for (const double offset : {-2 * kPi, 2 * kPi, -kPi}) {
    RoomRecords room;
    for (double& turn : room.turn) {
      if (offset == -kPi ? turn > 0 : true) turn += offset == -kPi ? -2 * kPi : offset;
    }
    ExpectTheRoom(room.Setup(Both(room.Spherical(), room.Indices())));
  }
}

// While it turns, a scanner measures the upper rows of a column a little later: up to half a step.
TEST_F(E57Test, AGridFollowsWhatWasMeasured) {
  RoomRecords skewed;
  const double step = 2 * kPi / 40;
  for (size_t i = 0; i < skewed.size(); ++i) {
    const auto row = static_cast<size_t>(skewed.row[i]);
    const auto column = static_cast<size_t>(skewed.column[i]);
    const double azimuth =
        skewed.azimuth[column] + 0.45 * step * (static_cast<double>(row) / (kRows - 1) - 0.5);
    const Eigen::Vector3d d = DirectionOf(azimuth, skewed.elevation[row]);
    skewed.range[i] = RoomRange(d);
    skewed.turn[i] = azimuth;
  }
  const auto scan = Parse(skewed.Setup(Both(skewed.Spherical(), skewed.Indices())));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_FALSE(scan->resampled);
  EXPECT_EQ(scan->image.columns(), 40);
  for (int c = 0; c < 40; ++c) {
    EXPECT_NEAR(scan->image.azimuth[static_cast<size_t>(c)], skewed.azimuth[static_cast<size_t>(c)],
                0.25 * step);
  }
}

TEST_F(E57Test, EachSetupHasItsPoseAndItsName) {
  const double s = std::sqrt(0.5);
  const std::vector<E57Stream> streams = Both(room_.Cartesian(), room_.Indices());
  const std::string file = WriteE57({room_.Setup(streams, "<name type=\"String\">first</name>"),
                                     room_.Setup(streams, "<name type=\"String\">second</name>" +
                                                              E57Pose(s, 0, 0, s, 10, 20, 30)),
                                     room_.Setup(streams, E57Pose(1, 0, 0, 0, 0, 0, 0))});
  EXPECT_EQ(ListE57Setups(file).value(), (std::vector<std::string>{"first", "second", ""}));
  EXPECT_FALSE(ParseE57(file, 0, {}).value().T_world_scan.has_value());
  const ImportedScan second = ParseE57(file, 1, {}).value();
  ASSERT_TRUE(second.T_world_scan.has_value());
  EXPECT_TRUE((*second.T_world_scan * Eigen::Vector3d(1, 0, 0))
                  .isApprox(Eigen::Vector3d(10, 21, 30), 1e-12));
  ExpectSameImage(second.image, ptx_.image);  // points are the set-up's own
  EXPECT_FALSE(ParseE57(file, 2, {}).value().T_world_scan.has_value());
  const absl::Status none = ParseE57(file, 3, {}).status();
  EXPECT_TRUE(absl::IsInvalidArgument(none)) << none;
}

TEST_F(E57Test, WhatCannotBeAScanIsRefusedByName) {
  E57SetupFile empty = room_.Setup(room_.Cartesian(), "<name type=\"String\">hall</name>");
  empty.records = 0;
  E57SetupFile many = room_.Setup(room_.Cartesian());
  many.records = 200'000'000;
  E57SetupFile invalid = room_.Setup(
      Both(room_.Cartesian(),
           {E57Integers("cartesianInvalidState", 0, 2, std::vector<int64_t>(room_.size(), 2))}));
  E57SetupFile text =
      room_.Setup({E57Texts("cartesianX", std::vector<std::string>(room_.size(), "1")),
                   room_.Cartesian()[1], room_.Cartesian()[2]});
  E57SetupFile fraction =
      room_.Setup(Both(room_.Cartesian(), {E57Doubles("rowIndex", room_.x),
                                           E57Integers("columnIndex", 0, 511, room_.column)}));
  struct Wrong {
    E57SetupFile setup;
    const char* says;
  };
  for (const Wrong& wrong :
       {Wrong{empty, "set-up 1 (hall): it has no points"}, Wrong{many, "200000000 records"},
        Wrong{invalid, "none of its"}, Wrong{text, "cartesianX is a text"},
        Wrong{fraction, "rowIndex is no whole number"},
        Wrong{room_.Setup(room_.Indices()), "neither cartesian nor spherical"}}) {
    const absl::Status status = Parse(wrong.setup).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status)) << status;
    EXPECT_TRUE(absl::StrContains(status.message(), wrong.says)) << status;
  }
  EXPECT_TRUE(absl::IsInvalidArgument(ParseE57(WriteE57({}), 0, {}).status()));
}

// ---- Real files.

std::string SharedFile(const std::string& name) {
  const char* folder = std::getenv("VANTAGE_SHARED_DATA");
  return std::string(folder == nullptr ? "" : folder) + "/e57_files/" + name;
}

// Its columns lean by one and a half steps from bottom to top, so that they share no azimuth: the
// returns are interpolated along straight lines, and nearly all are left.
TEST(RealE57Scan, APumpRoomIsRead) {
  const std::string path = SharedFile("pumpARowColumnIndexNoInvalidPoints.e57");
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "set VANTAGE_SHARED_DATA to the folder with e57_files";
  }
  const absl::StatusOr<ImportedScan> scan = ReadScanFile(path, {});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->points, 155'201U);
  EXPECT_TRUE(scan->resampled);
  EXPECT_FALSE(scan->image.full_turn);
  EXPECT_GT(scan->image.SampleCount(), 152'000U);
  EXPECT_EQ(scan->image.columns(), 345);
  EXPECT_NEAR(scan->image.rows(), 1074, 2);
  EXPECT_NEAR(Degrees(scan->image.native_azimuth_step), 0.25, 0.005);
  EXPECT_FALSE(scan->T_world_scan.has_value());
  // As its sphericalBounds say.
  EXPECT_NEAR(scan->image.elevation.front(), -0.785, 0.005);
  EXPECT_NEAR(scan->image.elevation.back(), 0.481, 0.005);
  for (const float range : scan->image.range) {
    if (!RangeImage::IsRange(range)) continue;
    ASSERT_GT(range, 1.9);
    ASSERT_LT(range, 5.5);
  }
}

TEST(RealE57Scan, FilesWithoutAScanAreRefusedInWords) {
  if (!std::filesystem::exists(SharedFile("empty.e57"))) {
    GTEST_SKIP() << "set VANTAGE_SHARED_DATA to the folder with e57_files";
  }
  for (const char* name : {"empty", "bad-crc", "ZeroPoints", "ZeroPointsInvalid", "NoPrototype",
                           "InvalidCVHeader", "InvalidFileLength"}) {
    const absl::Status status = ReadScanFile(SharedFile(std::string(name) + ".e57"), {}).status();
    EXPECT_TRUE(absl::IsInvalidArgument(status) || absl::IsDataLoss(status)) << name << status;
    EXPECT_TRUE(absl::StrContains(status.message(), "E57")) << status;
  }
}

}  // namespace
}  // namespace vantage::sensor
