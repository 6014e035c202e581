// Holes in scans against discs that were cut into them.
#include "core/model/scan/hole_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/random_sequence.h"

namespace vantage::model {
namespace {

// Discs of rays that did not come back, in a sphere of those that did.
TEST(HoleMap, FindsHolesAndLeavesTheRest) {
  for (const double step : {sensor::Radians(0.4), sensor::Radians(2)}) {
    int near_a_hole = 0;
    int far_from_one = 0;
    for (uint64_t seed = 1; seed <= 20; ++seed) {
      simulation::RandomSequence random(seed);
      sensor::RangeImage image;
      sensor::ScannerModel scanner;
      scanner.azimuth_step = scanner.elevation_step = step;
      for (double a = -sensor::kPi; a < sensor::kPi - step / 2; a += step)
        image.azimuth.push_back(a);
      for (double e = -1.0; e < sensor::kPi / 2 - step / 2; e += step) image.elevation.push_back(e);
      image.full_turn = true;
      image.native_azimuth_step = image.native_elevation_step = step;
      image.range.assign(image.azimuth.size() * image.elevation.size(), 3.0f);
      const double radius = sensor::Radians(random.Between(10, 30));
      const double azimuth = random.Between(-sensor::kPi, sensor::kPi);
      const double elevation = random.Between(-0.6, 1.5);
      const Eigen::Vector3d middle(std::cos(elevation) * std::cos(azimuth),
                                   std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      size_t i = 0;
      for (int c = 0; c < image.columns(); ++c) {
        for (int r = 0; r < image.rows(); ++r, ++i) {
          if (std::acos(std::min(1.0, image.Direction(c, r).dot(middle))) < radius ||
              random.Chance(0.05)) {
            image.range[i] = sensor::RangeImage::kNoReturn;
          }
        }
      }
      parallel::Serial serial;
      const HoleMap holes(RangeSurface(image, scanner, 0.1, serial));
      EXPECT_FALSE(holes.empty());
      const double bin = std::max(sensor::Radians(3), 4 * step);
      for (int k = 0; k < 300; ++k) {
        const double a = random.Between(-sensor::kPi, sensor::kPi);
        const double e = random.Between(-0.9, 1.5);
        const Eigen::Vector3d d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
        const double reach = random.Between(0.01, 0.3);
        const double off = std::acos(std::clamp(d.dot(middle), -1.0, 1.0));
        if (off < radius + reach - 1.5 * bin) {
          ++near_a_hole;
          EXPECT_TRUE(holes.Near(4 * d, reach)) << seed << ": " << off << " of " << radius;
        }
        // Where bins are narrow, near the poles, a few drop-outs make one.
        if (off > radius + reach + 3 * bin && std::abs(e) + reach + 2 * bin < 1.2) {
          ++far_from_one;
          EXPECT_FALSE(holes.Near(d, reach)) << seed << ": " << off << " of " << radius;
        }
      }
    }
    EXPECT_GT(near_a_hole, 200);
    EXPECT_GT(far_from_one, 200);
  }
}

}  // namespace
}  // namespace vantage::model
