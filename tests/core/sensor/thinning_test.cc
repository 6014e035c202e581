// Previews: which rays are kept, and how a preview is told from another scan.
#include "core/sensor/thinning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/core/sensor/analytic_room.h"

namespace vantage::sensor {
namespace {

RangeImage Image(std::vector<double> azimuth, std::vector<double> elevation, double native,
                 bool full_turn, const Eigen::Vector3d& centre = {0, 0, 0}) {
  RangeImage image;
  image.azimuth = std::move(azimuth);
  image.elevation = std::move(elevation);
  image.full_turn = full_turn;
  image.native_azimuth_step = image.native_elevation_step = native;
  for (const double a : image.azimuth) {
    for (const double e : image.elevation) {
      image.range.push_back(static_cast<float>(RoomRange(DirectionOf(a, e), centre)));
    }
  }
  return image;
}

RangeImage Whole(double step, const Eigen::Vector3d& centre = {0, 0, 0}) {
  const auto columns = static_cast<size_t>(std::lround(2 * kPi / step));
  return Image(Evenly(-kPi, 2 * kPi / static_cast<double>(columns), columns),
               Evenly(Radians(-60), step, static_cast<size_t>(Radians(150) / step)), step, true,
               centre);
}

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
    const RangeImage image = Image(azimuth, Evenly(-1, native, 60), native, run % 2 == 0);
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
  const RangeImage image = Whole(Radians(1));
  const RangeImage thin = Thinned(image, Radians(0.25));
  EXPECT_EQ(thin.azimuth, image.azimuth);
  EXPECT_EQ(thin.elevation, image.elevation);
  EXPECT_EQ(thin.range, image.range);
}

TEST(Thinning, ThinsByTheSquareOfTheStep) {
  const RangeImage image = Whole(Radians(0.1));
  const RangeImage thin = Thinned(image, Radians(1));
  EXPECT_NEAR(static_cast<double>(image.cells()) / static_cast<double>(thin.cells()), 100, 5);
}

// Whose few returns would all be left out.
TEST(Thinning, NeverEndsWithoutAReturn) {
  RangeImage image = Whole(Radians(0.5));
  std::fill(image.range.begin(), image.range.end(), RangeImage::kNoReturn);
  image.range[image.Index(11, 13)] = 2.0f;
  EXPECT_GT(Thinned(image, Radians(5)).SampleCount(), 0u);
}

TEST(Thinning, APreviewAgreesWithItsScanAndWithNoOther) {
  const RangeImage whole = Whole(Radians(0.25));
  EXPECT_EQ(ShareThatAgrees(whole, Thinned(whole, Radians(1.5))), 1.0);
  // One that the instrument made on a grid of its own.
  EXPECT_GT(ShareThatAgrees(whole, Image(Evenly(-3.1, Radians(1.37), 250),
                                         Evenly(-0.9, Radians(1.37), 90), Radians(0.25), true)),
            0.97);
  // From a step aside, and turned.
  for (const Eigen::Vector3d& centre : {Eigen::Vector3d(0.6, 0.4, 0), Eigen::Vector3d(-1, 1, 0)}) {
    const RangeImage other = Whole(Radians(0.25), centre);
    EXPECT_LT(ShareThatAgrees(other, Thinned(whole, Radians(1.5))), 0.3);
  }
  RangeImage turned = whole;
  std::rotate(turned.range.begin(),
              turned.range.begin() + static_cast<std::ptrdiff_t>(turned.cells() / 7 * 1),
              turned.range.end());
  EXPECT_LT(ShareThatAgrees(turned, Thinned(whole, Radians(1.5))), 0.5);
}

}  // namespace
}  // namespace vantage::sensor
