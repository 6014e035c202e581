// How a preview is told from another scan, and a copy of a scan from a second one.
#include "core/sensor/likeness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/sensor/thinning.h"
#include "tests/core/sensor/analytic_room.h"

namespace vantage::sensor {
namespace {

RangeImage Noisy(RangeImage image, uint32_t seed, float sigma) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, sigma);
  for (float& range : image.range) range += noise(random);
  return image;
}

TEST(Likeness, APreviewAgreesWithItsScanAndWithNoOther) {
  const RangeImage whole = RoomAllAround(Radians(0.25));
  EXPECT_EQ(ShareThatAgrees(whole, Thinned(whole, Radians(1.5))), 1.0);
  // One that the instrument made on a grid of its own.
  EXPECT_GT(ShareThatAgrees(whole, RoomImage(Evenly(-3.1, Radians(1.37), 250),
                                             Evenly(-0.9, Radians(1.37), 90), Radians(0.25), true)),
            0.97);
  // From a step aside, and turned.
  for (const Eigen::Vector3d& centre : {Eigen::Vector3d(0.6, 0.4, 0), Eigen::Vector3d(-1, 1, 0)}) {
    const RangeImage other = RoomAllAround(Radians(0.25), centre);
    EXPECT_LT(ShareThatAgrees(other, Thinned(whole, Radians(1.5))), 0.3);
  }
  RangeImage turned = whole;
  std::rotate(turned.range.begin(),
              turned.range.begin() + static_cast<std::ptrdiff_t>(turned.cells() / 7 * 1),
              turned.range.end());
  EXPECT_LT(ShareThatAgrees(turned, Thinned(whole, Radians(1.5))), 0.5);
}

// A tank, a dome: no direction tells more than the others.
TEST(Likeness, APreviewAgreesWithItsScanInARoundPlace) {
  RangeImage round = RoomAllAround(Radians(0.5));
  for (int c = 0; c < round.columns(); ++c) {
    for (int r = 0; r < round.rows(); ++r) {
      round.range[round.Index(c, r)] = 4.0f + 0.01f * static_cast<float>(r);
    }
  }
  EXPECT_EQ(ShareThatAgrees(round, Thinned(round, Radians(2))), 1.0);
  RangeImage wider = round;
  for (float& range : wider.range) range += 0.5f;
  EXPECT_EQ(ShareThatAgrees(wider, Thinned(round, Radians(2))), 0.0);
}

TEST(Likeness, CopiesHaveTheSameSamplesAndASecondScanHasNot) {
  const RangeImage scan = Noisy(RoomAllAround(Radians(0.5)), 1, 0.001f);
  EXPECT_TRUE(SameSamples(scan, scan));
  EXPECT_TRUE(SameSamples(scan, Thinned(scan, Radians(2))));
  EXPECT_TRUE(SameSamples(Thinned(scan, Radians(2)), scan));
  // As other formats round it, and with what an exporter cuts.
  RangeImage rounded = scan;
  for (float& range : rounded.range) range = std::round(range * 1e4f) / 1e4f;
  for (size_t i = 0; i < rounded.range.size() / 3; ++i) rounded.range[i] = RangeImage::kNoReturn;
  EXPECT_TRUE(SameSamples(scan, rounded));
  // A tenth of a good instrument's noise, and another place.
  EXPECT_FALSE(SameSamples(scan, Noisy(RoomAllAround(Radians(0.5)), 2, 0.0005f)));
  EXPECT_FALSE(SameSamples(scan, RoomAllAround(Radians(0.5), {0.3, 0, 0})));
}

}  // namespace
}  // namespace vantage::sensor
