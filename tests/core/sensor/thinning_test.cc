// Previews: which rays are kept.
#include "core/sensor/thinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/core/sensor/analytic_room.h"

namespace vantage::sensor {
namespace {

TEST(Thinning, KeepsMeasuredRaysThatLieAtLeastTheStepApart) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int run = 0; run < 50; ++run) {
    SCOPED_TRACE(run);
    const double native = Radians(0.2 + 0.6 * uniform(random));
    const double step = native * (1 + 5 * uniform(random));
    // Columns that are not evenly spaced, by up to half a step.
    std::vector<double> azimuth;
    for (double a = -kPi; a < kPi - native; a += native) {
      azimuth.push_back(a + 0.49 * native * uniform(random));
    }
    const RangeImage image = RoomImage(azimuth, Evenly(-1, native, 60), native, run % 2 == 0);
    const RangeImage thin = Thinned(image, step);
    ASSERT_TRUE(thin.Validate().ok());
    EXPECT_EQ(thin.full_turn, image.full_turn);
    EXPECT_EQ(thin.native_azimuth_step, native);
    EXPECT_EQ(thin.native_elevation_step, native);
    for (int c = 0; c < thin.columns(); ++c) {
      for (int r = 0; r < thin.rows(); ++r) {
        const Eigen::Vector3d d = thin.Direction(c, r);
        ASSERT_NEAR(thin.at(c, r), RoomRange(d), 1e-4);
      }
      const size_t next = static_cast<size_t>(c) + 1;
      if (next == thin.azimuth.size()) break;
      ASSERT_GE(thin.azimuth[next] - thin.azimuth[next - 1], step - 0.5 * native - 1e-12);
      ASSERT_LE(thin.azimuth[next] - thin.azimuth[next - 1], step + 1.5 * native);
    }
    if (thin.full_turn) {
      EXPECT_GE(2 * kPi + thin.azimuth.front() - thin.azimuth.back(), step - 0.5 * native - 1e-12);
    }
  }
}

TEST(Thinning, LeavesWhatIsCoarse) {
  const RangeImage image = RoomAllAround(Radians(1));
  const RangeImage thin = Thinned(image, Radians(0.25));
  EXPECT_EQ(thin.azimuth, image.azimuth);
  EXPECT_EQ(thin.elevation, image.elevation);
  EXPECT_EQ(thin.range, image.range);
}

TEST(Thinning, ThinsByTheSquareOfTheStep) {
  const RangeImage image = RoomAllAround(Radians(0.1));
  const RangeImage thin = Thinned(image, Radians(1));
  EXPECT_NEAR(static_cast<double>(image.cells()) / static_cast<double>(thin.cells()), 100, 5);
}

// Whose few returns would all be left out.
TEST(Thinning, NeverEndsWithoutAReturn) {
  RangeImage image = RoomAllAround(Radians(0.5));
  std::fill(image.range.begin(), image.range.end(), RangeImage::kNoReturn);
  image.range[image.Index(11, 13)] = 2.0f;
  EXPECT_GT(Thinned(image, Radians(5)).SampleCount(), 0u);
}

}  // namespace
}  // namespace vantage::sensor
