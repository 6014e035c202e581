// Rays into the open sky in closed form: how far they go, and where a surface may go on.
#include "core/model/scan/sky.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

using Eigen::Vector3d;

class SkyTest : public testing::TestWithParam<test_support::ScannerCase> {
 protected:
  static constexpr double kHeight = 1.5;  // m, of the scanner over the ground

  // `cast(from, ray)`: m, 0 where nothing returns.
  using Cast = std::function<double(const Vector3d&, const Vector3d&)>;
  std::vector<SkyRay> Find(double range_max, const Cast& cast) {
    sensor::ScannerModel scanner =
        test_support::Sector(GetParam(), 2 * sensor::kPi, sensor::Radians(60));
    scanner.elevation_max = sensor::kPi / 2;
    scanner.range_max = range_max;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(Vector3d(0, 0, kHeight));
    const sensor::Scan scan = test_support::ScanBy(scanner, pose, 1, cast);
    image_ = scan.image;
    return FindSkyRays(RangeSurface(scan.image, scanner, 0.14, serial_), scanner,
                       Vector3d::UnitZ());
  }
  double Elevation(const SkyRay& ray) const {
    return image_.elevation[static_cast<size_t>(ray.row)];
  }
  // sr, near the horizon.
  static double Area(size_t cells) {
    return static_cast<double>(cells) * GetParam().step * GetParam().step;
  }
  static double ToGround(const Vector3d& from, const Vector3d& ray) {
    return ray.z() < 0 ? -from.z() / ray.z() : 0;
  }

  parallel::Serial serial_;
  sensor::RangeImage image_;
};

// A field, last measured near the end of the range: so it may go on, as a plane that is level to a
// degree, and what lies behind where rays would meet that stays wanted.
TEST_P(SkyTest, AFieldGoesOnBehindTheHorizon) {
  // By the second row below the horizon; the first would meet it three times as far away.
  const double last = kHeight / std::sin(1.5 * GetParam().step);
  const auto range_max = static_cast<float>(1.22 * last);
  const std::vector<SkyRay> rays = Find(static_cast<double>(range_max), ToGround);
  int high = 0;
  int low = 0;
  for (const SkyRay& ray : rays) {
    const double elevation = Elevation(ray);
    if (elevation > sensor::Radians(3)) {
      ++high;
      ASSERT_EQ(ray.range, range_max / 2) << elevation;
      ASSERT_EQ(ray.beyond, UnknownReason::kSky) << elevation;
    } else if (elevation < 0) {
      ++low;
      // At a degree rays to the far ground come nearer to level than the scanner reaches.
      const double met = kHeight / (0.02 - std::sin(elevation));
      ASSERT_NEAR(ray.range, std::min<double>(met, range_max / 2), 1) << elevation;
      ASSERT_EQ(ray.beyond, met < range_max / 2 ? UnknownReason::kHole : UnknownReason::kSky)
          << elevation;
    }
  }
  // All of them, and nearly all around.
  const double columns = 2 * sensor::kPi / GetParam().step;
  EXPECT_GT(high, 0.97 * columns * (sensor::Radians(87) / GetParam().step));
  EXPECT_GT(low, 0.97 * columns);
}

// From a terrace, below which is water: no ray that goes down is free beyond level ground.
TEST_P(SkyTest, BeyondAnEdgeNothingIsPromised) {
  const std::vector<SkyRay> rays = Find(40, [](const Vector3d& from, const Vector3d& ray) {
    const double range = ToGround(from, ray);
    return range * ray.x() < 2 ? range : 0;
  });
  size_t down = 0;
  for (const SkyRay& ray : rays) {
    const double elevation = Elevation(ray);
    if (elevation >= 0) continue;
    ++down;
    ASSERT_LE(ray.range, kHeight / std::sin(-elevation)) << elevation;
  }
  EXPECT_GT(Area(down), 0.15);
}

// The same on a slope that rises to the left and ends ahead: there its own plane is what is level
// ground elsewhere, and rays that come down to it end before the level of the scanner's feet.
TEST_P(SkyTest, OverTheEdgeOfASlopeNothingIsPromised) {
  constexpr double kRise = 0.15;
  const auto to_slope = [](const Vector3d& from, const Vector3d& ray) {
    const double down = kRise * ray.y() - ray.z();
    return down > 0 ? from.z() / down : 0;
  };
  const std::vector<SkyRay> rays = Find(40, [&](const Vector3d& from, const Vector3d& ray) {
    const double range = to_slope(from, ray);
    return range * ray.x() < 6 ? range : 0;
  });
  size_t down = 0;
  for (const SkyRay& ray : rays) {
    const double elevation = Elevation(ray);
    const double azimuth = image_.azimuth[static_cast<size_t>(ray.column)];
    // Up the slope, and over its edge.
    if (elevation >= 0 || azimuth < sensor::Radians(10) || azimuth > sensor::Radians(40)) continue;
    ++down;
    const Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                             std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    // What its samples are off by tilts the plane.
    ASSERT_LE(ray.range, 1.05 * to_slope(Vector3d(0, 0, kHeight), direction))
        << elevation << " " << azimuth;
    ASSERT_EQ(ray.beyond, UnknownReason::kSky) << elevation << " " << azimuth;
  }
  EXPECT_GT(Area(down), 0.02);
}

// A yard that ends 6 m ahead and 16 m to all other sides, and whose returns get lost the more
// grazingly they are met. Ahead it ends: farther ground came back. Where no ground did, it may go
// on.
TEST_P(SkyTest, GroundThatEndsNearerThanGroundIsStillMeasuredBreaksOff) {
  std::mt19937_64 random(8);
  const std::vector<SkyRay> rays = Find(60, [&](const Vector3d& from, const Vector3d& ray) {
    const double range = ToGround(from, ray);
    const Vector3d at = from + range * ray;
    if (at.x() > 6 || at.head<2>().norm() > 16) return 0.0;
    const double grazing = sensor::Radians(10) + std::asin(std::min(ray.z(), 0.0));
    const double lost = grazing > 0 ? grazing / sensor::Radians(10) : 0;
    return std::generate_canonical<double, 32>(random) < lost ? 0.0 : range;
  });
  size_t ahead = 0;
  size_t promised_ahead = 0;
  size_t promised = 0;
  for (const SkyRay& ray : rays) {
    if (Elevation(ray) >= 0) continue;
    const double azimuth = image_.azimuth[static_cast<size_t>(ray.column)];
    const bool goes_ahead = std::abs(std::remainder(azimuth, 2 * sensor::kPi)) < 0.7;
    ahead += goes_ahead ? 1 : 0;
    const bool hole = ray.beyond == UnknownReason::kHole;
    (goes_ahead ? promised_ahead : promised) += hole ? 1 : 0;
  }
  EXPECT_GT(Area(ahead), 0.075);
  EXPECT_LT(Area(promised_ahead), 0.01 * Area(ahead));
  EXPECT_GT(Area(promised), 0.075);
}

// A wall of which one ray in seven returns stands there, however little comes back.
TEST_P(SkyTest, WhatReturnsInPartIsNoSky) {
  std::mt19937_64 random(5);
  const auto on_wall = [](const Vector3d& from, const Vector3d& ray) {
    if (ray.x() <= 0) return 0.0;
    const double range = 10 / ray.x();
    const Vector3d at = from + range * ray;
    return at.z() > 0 && at.z() < 12 && std::abs(at.y()) < 10 ? range : 0.0;
  };
  const std::vector<SkyRay> rays = Find(40, [&](const Vector3d& from, const Vector3d& ray) {
    const double wall = on_wall(from, ray);
    if (wall == 0) return ToGround(from, ray);
    return random() % 7 == 0 ? wall : 0.0;
  });
  const Vector3d from(0, 0, kHeight);
  size_t within = 0;
  for (const SkyRay& ray : rays) {
    // Away from its border, where half of what lies around is sky.
    bool inside = true;
    for (const double up : {-0.06, 0.06}) {
      for (const double aside : {-0.06, 0.06}) {
        const double azimuth = image_.azimuth[static_cast<size_t>(ray.column)] + aside;
        const double elevation = Elevation(ray) + up;
        inside = inside &&
                 on_wall(from, {std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation)}) > 0;
      }
    }
    within += inside ? 1 : 0;
  }
  EXPECT_GT(Area(rays.size()), 3.8);
  EXPECT_LT(Area(within), 0.0115);  // of 1.15 on the wall
}

// A hall too high to be told by its height, with a skylight over the scanner that is a quarter of
// what is overhead.
TEST_P(SkyTest, ASkylightInAHighHallIsNoSky) {
  const std::vector<SkyRay> rays = Find(40, [](const Vector3d& from, const Vector3d& ray) {
    double nearest = 100;
    for (const double wall : {-10.0, 10.0}) {
      for (int axis = 0; axis < 2; ++axis) {
        if (ray[axis] * wall > 0) nearest = std::min(nearest, (wall - from[axis]) / ray[axis]);
      }
    }
    const double level = ray.z() > 0 ? (8 - from.z()) / ray.z() : ToGround(from, ray);
    if (level == 0 || level > nearest) return nearest;
    const Vector3d at = from + level * ray;
    return ray.z() > 0 && std::abs(at.x()) < 0.5 && std::abs(at.y()) < 0.5 ? 0.0 : level;
  });
  EXPECT_TRUE(rays.empty()) << rays.size();
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, SkyTest, testing::ValuesIn(test_support::kThreeScanners));

}  // namespace
}  // namespace vantage::model
