// Rays into the open sky in closed form: how far they go, and where a surface may go on.
#include "core/model/scan/sky.h"

#include <gtest/gtest.h>

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

class SkyTest : public testing::Test {
 protected:
  static constexpr double kHeight = 1.5;  // m, of the scanner over the ground

  // `cast(from, ray)`: m, 0 where nothing returns.
  using Cast = std::function<double(const Vector3d&, const Vector3d&)>;
  std::vector<SkyRay> Find(double range_max, const Cast& cast) {
    sensor::ScannerModel scanner = test_support::Sector({"", sensor::Radians(0.5), 0.001},
                                                        2 * sensor::kPi, sensor::Radians(60));
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
  static double ToGround(const Vector3d& from, const Vector3d& ray) {
    return ray.z() < 0 ? -from.z() / ray.z() : 0;
  }

  parallel::Serial serial_;
  sensor::RangeImage image_;
};

// A field, last measured 115 m away, near the end of the range: so it may go on, as a plane that is
// level to a degree, and what lies behind where rays would meet that stays wanted.
TEST_F(SkyTest, AFieldGoesOnBehindTheHorizon) {
  const std::vector<SkyRay> rays = Find(140, ToGround);
  int high = 0;
  int low = 0;
  for (const SkyRay& ray : rays) {
    const double elevation = Elevation(ray);
    if (elevation > sensor::Radians(3)) {
      ++high;
      ASSERT_EQ(ray.range, 70) << elevation;  // half of what the scanner reaches
      ASSERT_EQ(ray.beyond, UnknownReason::kSky) << elevation;
    } else if (elevation < 0) {
      ++low;
      ASSERT_NEAR(ray.range, kHeight / (0.02 - std::sin(elevation)), 1) << elevation;
      ASSERT_EQ(ray.beyond, UnknownReason::kHole) << elevation;
    }
  }
  EXPECT_GT(high, 720 * 170);  // all of them
  EXPECT_GT(low, 700);
}

// From a terrace, below which is water: no ray that goes down is free beyond level ground.
TEST_F(SkyTest, BeyondAnEdgeNothingIsPromised) {
  const std::vector<SkyRay> rays = Find(40, [](const Vector3d& from, const Vector3d& ray) {
    const double range = ToGround(from, ray);
    return range * ray.x() < 2 ? range : 0;
  });
  int down = 0;
  for (const SkyRay& ray : rays) {
    const double elevation = Elevation(ray);
    if (elevation >= 0) continue;
    ++down;
    ASSERT_LE(ray.range, kHeight / std::sin(-elevation)) << elevation;
  }
  EXPECT_GT(down, 2000);
}

// A wall of which one ray in seven returns stands there, however little comes back.
TEST_F(SkyTest, WhatReturnsInPartIsNoSky) {
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
  int within = 0;
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
  EXPECT_GT(rays.size(), 50'000u);
  EXPECT_LT(within, 150);  // of 15,000 on the wall
}

// A hall too high to be told by its height, with a skylight over the scanner that is a quarter of
// what is overhead.
TEST_F(SkyTest, ASkylightInAHighHallIsNoSky) {
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

}  // namespace
}  // namespace vantage::model
