
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/sensor/grid_columns.h"
#include "core/sensor/grid_directions.h"
#include "core/sensor/gridded_scan.h"
#include "core/sensor/scanner_body.h"
#include "tests/core/sensor/analytic_room.h"

namespace vantage::sensor {
namespace {

const auto kAlways = [](size_t, size_t) { return true; };

std::vector<Eigen::Vector3f> Floats(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3f> floats;
  floats.reserve(points.size());
  for (const Eigen::Vector3d& p : points) floats.push_back(p.cast<float>());
  return floats;
}

// Every range agrees with the room along the ray that the image states for it.
void ExpectRoom(const RangeImage& image, double tolerance) {
  ASSERT_TRUE(image.Validate().ok()) << image.Validate();
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const float range = image.at(column, row);
      if (!RangeImage::IsRange(range)) continue;
      ASSERT_NEAR(range, RoomRange(image.Direction(column, row)), tolerance)
          << "column " << column << " row " << row;
    }
  }
}

double UniformOf(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

// Irregular, like a real spinning head: 0.3 to 1.7 of the mean step.
std::vector<double> IrregularTurn(uint64_t seed, size_t count) {
  std::mt19937_64 random(seed);
  std::vector<double> steps;
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    steps.push_back(0.3 + 1.4 * UniformOf(random));
    sum += steps.back();
  }
  std::vector<double> lines;
  double at = 0.4;
  for (size_t i = 0; i < count; ++i) {
    lines.push_back(at);
    at += steps[i] * 2 * kPi / sum;
  }
  return lines;
}

class GridColumnsTest : public testing::TestWithParam<std::tuple<bool, bool, bool>> {};

TEST_P(GridColumnsTest, FindsTheAxesWhicheverWayTheScannerTurns) {
  const auto [clockwise, downwards, rows_first] = GetParam();
  std::vector<double> azimuth = IrregularTurn(5, 90);
  std::vector<double> elevation = Evenly(Radians(-60), Radians(3), 49);
  if (clockwise) std::reverse(azimuth.begin(), azimuth.end());
  if (downwards) std::reverse(elevation.begin(), elevation.end());
  const auto returns = [](size_t column, size_t row) { return (column * 7 + row) % 11 != 0; };
  std::vector<Eigen::Vector3f> points = Floats(ScanRoom(azimuth, elevation, returns));
  size_t columns = azimuth.size();
  size_t rows = elevation.size();
  if (rows_first) {
    std::vector<Eigen::Vector3f> transposed;
    for (size_t row = 0; row < rows; ++row) {
      for (size_t column = 0; column < columns; ++column) {
        transposed.push_back(points[column * rows + row]);
      }
    }
    points = transposed;
    std::swap(columns, rows);
  }
  const absl::StatusOr<GriddedScan> scan = GridColumns(points, columns, rows);
  ASSERT_TRUE(scan.ok()) << scan.status();
  const RangeImage& image = scan->image;
  EXPECT_FALSE(scan->resampled);
  EXPECT_EQ(scan->duplicates, 0u);
  EXPECT_TRUE(image.full_turn);
  ASSERT_EQ(image.columns(), 90);
  ASSERT_EQ(image.rows(), 49);
  EXPECT_NEAR(image.native_elevation_step, Radians(3), 1e-6);
  ExpectRoom(image, 1e-4);
  EXPECT_EQ(image.SampleCount(),
            static_cast<size_t>(std::count_if(points.begin(), points.end(),
                                              [](const auto& p) { return !p.isZero(0); })));
  EXPECT_GT(image.azimuth.front(), -kPi);
  EXPECT_LE(image.azimuth.back(), kPi);
}

INSTANTIATE_TEST_SUITE_P(Ways, GridColumnsTest,
                         testing::Combine(testing::Bool(), testing::Bool(), testing::Bool()));

// Of long lines not all points tell the angle: the grid is the same, whichever way it was stored.
TEST(GridColumnsTest, LinesOfThousandsOfCellsKeepAllOfThem) {
  constexpr size_t kColumnCount = 2600;  // of which a row looks at every third
  constexpr size_t kRowCount = 1100;     // of which a column looks at every second
  const std::vector<double> azimuth = Evenly(-kPi + 0.001, 2 * kPi / kColumnCount, kColumnCount);
  const std::vector<double> elevation = Evenly(Radians(-60), Radians(0.13), kRowCount);
  const auto returns = [](size_t column, size_t row) {
    return (column + row) % 7 != 0 && (column < 300 || column > 340);  // an open door
  };
  const std::vector<Eigen::Vector3f> points = Floats(ScanRoom(azimuth, elevation, returns));
  std::vector<Eigen::Vector3f> by_rows(points.size());
  for (size_t column = 0; column < kColumnCount; ++column) {
    for (size_t row = 0; row < kRowCount; ++row) {
      by_rows[row * kColumnCount + column] = points[column * kRowCount + row];
    }
  }
  const auto as_put = GridColumns(points, kColumnCount, kRowCount);
  const auto turned = GridColumns(by_rows, kRowCount, kColumnCount);
  ASSERT_TRUE(as_put.ok()) << as_put.status();
  ASSERT_TRUE(turned.ok()) << turned.status();
  EXPECT_EQ(as_put->image.range, turned->image.range);
  const RangeImage& image = as_put->image;
  ASSERT_EQ(image.columns(), static_cast<int>(kColumnCount));
  ASSERT_EQ(image.rows(), static_cast<int>(kRowCount));
  EXPECT_FALSE(as_put->resampled);
  for (size_t i = 0; i < azimuth.size(); ++i) ASSERT_NEAR(image.azimuth[i], azimuth[i], 1e-5);
  for (size_t i = 0; i < elevation.size(); ++i) ASSERT_NEAR(image.elevation[i], elevation[i], 1e-5);
  size_t count = 0;
  for (const Eigen::Vector3f& p : points) count += p.isZero(0) ? 0 : 1;
  EXPECT_EQ(image.SampleCount(), count);
  ExpectRoom(image, 1e-4);
}

TEST(GridColumnsTest, LinesWithoutAnyReturnKeepTheirPlace) {
  const std::vector<double> azimuth = Evenly(-kPi + 0.01, Radians(2), 180);
  const std::vector<double> elevation = Evenly(Radians(-50), Radians(2), 60);
  // A glass front: columns 20 to 29; open sky: the uppermost 5 rows.
  const auto returns = [](size_t column, size_t row) {
    return (column < 20 || column >= 30) && row < 55;
  };
  const absl::StatusOr<GriddedScan> scan =
      GridColumns(Floats(ScanRoom(azimuth, elevation, returns)), 180, 60);
  ASSERT_TRUE(scan.ok()) << scan.status();
  const RangeImage& image = scan->image;
  ASSERT_EQ(image.columns(), 180);
  ASSERT_EQ(image.rows(), 60);
  for (size_t i = 0; i < azimuth.size(); ++i) EXPECT_NEAR(image.azimuth[i], azimuth[i], 1e-5);
  for (size_t i = 0; i < elevation.size(); ++i) EXPECT_NEAR(image.elevation[i], elevation[i], 1e-5);
  EXPECT_EQ(image.at(25, 10), RangeImage::kNoReturn);
  EXPECT_EQ(image.at(100, 59), RangeImage::kNoReturn);
  EXPECT_EQ(image.SampleCount(), 170u * 55u);
}

TEST(GridColumnsTest, ASectorIsNoFullTurnAndMayCrossTheCut) {
  const std::vector<double> azimuth = Evenly(Radians(120), Radians(1), 121);
  const std::vector<double> elevation = Evenly(Radians(-30), Radians(1), 61);
  const absl::StatusOr<GriddedScan> scan =
      GridColumns(Floats(ScanRoom(azimuth, elevation, kAlways)), 121, 61);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_FALSE(scan->image.full_turn);
  EXPECT_NEAR(scan->image.azimuth.front(), Radians(120), 1e-6);
  EXPECT_NEAR(scan->image.azimuth.back(), Radians(240), 1e-6);
  ExpectRoom(scan->image, 1e-4);
}

TEST(GridColumnsTest, MoreThanATurnIsATurnAndTheFirstStoredWins) {
  const std::vector<double> azimuth = Evenly(0.1, Radians(2), 184);
  const std::vector<double> elevation = Evenly(Radians(-30), Radians(2), 31);
  std::vector<Eigen::Vector3f> points = Floats(ScanRoom(azimuth, elevation, kAlways));
  for (size_t i = 180 * 31; i < points.size(); ++i) points[i] *= 1.01f;
  const absl::StatusOr<GriddedScan> scan = GridColumns(points, 184, 31);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->image.full_turn);
  EXPECT_EQ(scan->image.columns(), 180);
  EXPECT_EQ(scan->duplicates, 4u * 31u);
  ExpectRoom(scan->image, 1e-4);
}

TEST(GridDirectionsTest, FindsAnIrregularGridInAnyOrderWithPointsStoredTwice) {
  const std::vector<double> azimuth = IrregularTurn(9, 120);
  const std::vector<double> elevation = Evenly(Radians(-70), Radians(1.5), 106);
  const auto returns = [](size_t column, size_t row) { return (column * 3 + row) % 17 != 0; };
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& p : Floats(ScanRoom(azimuth, elevation, returns))) {
    if (p.isZero(0)) continue;
    points.push_back(p);
    points.push_back(p);
  }
  std::mt19937_64 random(3);
  std::shuffle(points.begin(), points.end(), random);
  const absl::StatusOr<GriddedScan> scan = GridDirections(points);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_FALSE(scan->resampled);
  EXPECT_TRUE(scan->image.full_turn);
  EXPECT_EQ(scan->image.columns(), 120);
  EXPECT_EQ(scan->image.rows(), 106);
  EXPECT_EQ(scan->duplicates, points.size() / 2);
  EXPECT_EQ(scan->image.SampleCount(), points.size() / 2);
  ExpectRoom(scan->image, 1e-4);
}

TEST(GridDirectionsTest, FillsLinesThatHaveNoPoint) {
  const std::vector<double> azimuth = Evenly(-3, Radians(2), 180);
  const std::vector<double> elevation = Evenly(Radians(-40), Radians(2), 50);
  const auto returns = [](size_t column, size_t row) {
    return column != 50 && column != 51 && row != 20;
  };
  const absl::StatusOr<GriddedScan> scan =
      GridDirections(Floats(ScanRoom(azimuth, elevation, returns)));
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->image.columns(), 180);
  ASSERT_EQ(scan->image.rows(), 50);
  EXPECT_NEAR(scan->image.elevation[20], elevation[20], 1e-5);
  EXPECT_EQ(scan->image.SampleCount(), 178u * 49u);
}

class TiltedScanTest : public testing::TestWithParam<double> {};

TEST_P(TiltedScanTest, IsResampledAlongTheNewRays) {
  // The room stays; the scanner's grid is tilted in it, so nothing lines up in azimuth and
  // elevation.
  const Eigen::Matrix3d tilt =
      Eigen::AngleAxisd(GetParam(), Eigen::Vector3d(1, 2, 0.1).normalized()).toRotationMatrix();
  std::vector<Eigen::Vector3f> points;
  for (const double a : Evenly(-kPi, Radians(0.8), 450)) {
    for (const double e : Evenly(Radians(-50), Radians(0.8), 160)) {
      const Eigen::Vector3d d = tilt * DirectionOf(a, e);
      points.push_back((RoomRange(d) * d).cast<float>());
    }
  }
  const absl::StatusOr<GriddedScan> scan = GridColumns(points, 450, 160);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->resampled);
  EXPECT_TRUE(scan->image.full_turn);
  const RangeImage& image = scan->image;
  // Inside a wall the plane is exact; at the room's edges a cell keeps the range of its own point.
  size_t exact = 0;
  size_t inside = 0;
  size_t inside_returns = 0;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const float range = image.at(column, row);
      const bool in_band = image.elevation[static_cast<size_t>(row)] > Radians(-20) &&
                           image.elevation[static_cast<size_t>(row)] < Radians(45);
      inside += in_band ? 1 : 0;
      if (!RangeImage::IsRange(range)) continue;
      inside_returns += in_band ? 1 : 0;
      const double truth = RoomRange(image.Direction(column, row));
      exact += std::abs(range - truth) < 1e-3 ? 1 : 0;
      ASSERT_NEAR(range, truth, 0.06 * truth);
    }
  }
  EXPECT_GT(static_cast<double>(exact), 0.9 * static_cast<double>(image.SampleCount()));
  EXPECT_GT(static_cast<double>(inside_returns), 0.95 * static_cast<double>(inside));
}

INSTANTIATE_TEST_SUITE_P(Tilts, TiltedScanTest, testing::Values(0.02, 0.1, 0.5));

// An instrument that stands askew by two steps: its columns and rows are still known.
TEST(GridColumnsTest, LinesThatLeanKeepNearlyAllReturns) {
  const Eigen::Matrix3d tilt =
      Eigen::AngleAxisd(Radians(0.5), Eigen::Vector3d(2, 1, 0).normalized()).toRotationMatrix();
  // Columns lie four times as far apart as rows: a grid of even steps would lose most returns.
  std::vector<Eigen::Vector3f> points;
  size_t count = 0;
  for (size_t column = 0; column < 360; ++column) {
    for (size_t row = 0; row < 480; ++row) {
      if ((column >= 100 && column < 120) && (row > 200 && row < 300)) {  // an open window
        points.emplace_back(0, 0, 0);
        continue;
      }
      const Eigen::Vector3d d =
          tilt * DirectionOf(-kPi + 0.01 + Radians(1.0) * static_cast<double>(column),
                             Radians(-60 + 0.25 * static_cast<double>(row)));
      points.push_back((RoomRange(d) * d).cast<float>());
      ++count;
    }
  }
  const absl::StatusOr<GriddedScan> scan = GridColumns(points, 360, 480);
  ASSERT_TRUE(scan.ok()) << scan.status();
  const RangeImage& image = scan->image;
  EXPECT_TRUE(scan->resampled);
  EXPECT_TRUE(image.full_turn);
  EXPECT_EQ(image.columns(), 360);
  EXPECT_NEAR(image.rows(), 480, 6);  // those that lean beyond the ends
  EXPECT_NEAR(image.native_elevation_step, Radians(0.25), 1e-4);
  EXPECT_GT(static_cast<double>(image.SampleCount()), 0.97 * static_cast<double>(count));
  EXPECT_EQ(image.SampleCount() + scan->duplicates, count);
  size_t exact = 0;
  size_t window = 0;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      const float range = image.at(column, row);
      if (column > 103 && column < 116 && row > 206 && row < 294) {
        window += RangeImage::IsRange(range) ? 0 : 1;
      }
      if (!RangeImage::IsRange(range)) continue;
      const double truth = RoomRange(image.Direction(column, row));
      exact += std::abs(range - truth) < 1e-3 ? 1 : 0;
      ASSERT_NEAR(range, truth, 0.06 * truth);
    }
  }
  EXPECT_GT(static_cast<double>(exact), 0.95 * static_cast<double>(image.SampleCount()));
  EXPECT_EQ(window, 12u * 87u);
}

// Where a point lies in the grid says nothing of its direction: the lines mean nothing.
TEST(GridColumnsTest, PointsInAnyOrderAreNoLinesThatLean) {
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()).toRotationMatrix();
  std::vector<Eigen::Vector3f> points;
  for (const double a : Evenly(-kPi, Radians(2), 180)) {
    for (const double e : Evenly(Radians(-50), Radians(2), 60)) {
      const Eigen::Vector3d d = tilt * DirectionOf(a, e);
      points.push_back((RoomRange(d) * d).cast<float>());
    }
  }
  std::mt19937_64 random(5);
  std::shuffle(points.begin(), points.end(), random);
  const absl::StatusOr<GriddedScan> known = GridColumns(points, 180, 60);
  const absl::StatusOr<GriddedScan> unknown = GridDirections(points);
  ASSERT_TRUE(known.ok()) << known.status();
  ASSERT_TRUE(unknown.ok()) << unknown.status();
  EXPECT_EQ(known->image.range, unknown->image.range);
}

TEST(GridDirectionsTest, RefusesWhatIsNoScan) {
  EXPECT_EQ(GridDirections({}).status().code(), absl::StatusCode::kInvalidArgument);
  const std::vector<Eigen::Vector3f> line(50, Eigen::Vector3f(1, 0, 0));
  EXPECT_EQ(GridDirections(line).status().code(), absl::StatusCode::kInvalidArgument);
  const std::vector<Eigen::Vector3f> nothing(50, Eigen::Vector3f::Zero());
  EXPECT_EQ(GridColumns(nothing, 5, 10).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(GridColumns(nothing, 5, 9).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(MaskScannerBodyTest, TakesTheBodyAndItsBlindZoneButNoWindow) {
  RangeImage image;
  image.azimuth = Evenly(-kPi + 0.01, Radians(2), 180);
  image.elevation = Evenly(Radians(-80), Radians(2), 80);
  image.native_azimuth_step = image.native_elevation_step = Radians(2);
  image.range.assign(image.cells(), 3.0f);
  for (int column = 0; column < 180; ++column) {
    for (int row = 0; row < 10; ++row) image.range[image.Index(column, row)] = 0.3f;
    for (int row = 10; row < 15; ++row) {
      image.range[image.Index(column, row)] = RangeImage::kNoReturn;
    }
  }
  // A shaft of no return that leads up from the blind zone, and a window apart from it.
  for (int row = 15; row < 60; ++row) image.range[image.Index(7, row)] = RangeImage::kNoReturn;
  for (int row = 40; row < 50; ++row) image.range[image.Index(90, row)] = RangeImage::kNoReturn;
  MaskScannerBody(0.5, Radians(30), image);
  for (int column = 0; column < 180; ++column) {
    for (int row = 0; row < 15; ++row) {
      EXPECT_EQ(image.at(column, row), RangeImage::kNoInformation);
    }
  }
  // 30 degrees from the uppermost row of the body (row 9) is row 24.
  EXPECT_EQ(image.at(7, 23), RangeImage::kNoInformation);
  EXPECT_EQ(image.at(7, 25), RangeImage::kNoReturn);
  EXPECT_EQ(image.at(90, 45), RangeImage::kNoReturn);
  EXPECT_EQ(image.at(91, 45), 3.0f);
}

}  // namespace
}  // namespace vantage::sensor
