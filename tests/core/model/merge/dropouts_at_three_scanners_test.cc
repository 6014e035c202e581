// Which voxels rays dropped out at, in closed form at three scanners.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/model/carve/carve.h"
#include "core/model/merge/dropouts.h"
#include "core/parallel/parallel.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

class DropoutsAtThreeScanners : public testing::TestWithParam<test_support::ScannerCase> {
 protected:
  static constexpr double kVoxel = 0.05;    // m
  static constexpr double kWall = 3.0;      // m before the scanner
  static constexpr double kHalfPane = 0.4;  // m, half a side of what nothing returns from
  static constexpr double kHeight = 1.5;    // m, of the scanner

  // A wall with a black square, straight before the scanner.
  std::unique_ptr<ScanLayer> Layer() {
    const sensor::ScannerModel scanner =
        test_support::Sector(GetParam(), sensor::Radians(70), sensor::Radians(30));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(Eigen::Vector3d(0, 0, kHeight));
    const sensor::Scan scan =
        test_support::ScanBy(scanner, pose, 5, [](const auto& from, const auto& ray) {
          const double range = (kWall - from.x()) / ray.x();
          const Eigen::Vector3d at = from + range * ray;
          return FromTheBorder(at) < 0 ? 0 : range;
        });
    ModelConfig config;
    config.voxel_size = kVoxel;
    return Carve(scan, pose, config, serial_);
  }
  // m, outwards.
  static double FromTheBorder(const Eigen::Vector3d& at) {
    return std::max(std::abs(at.y()), std::abs(at.z() - kHeight)) - kHalfPane;
  }
  // On the wall every five centimetres, with a normal that is turned by so much about z.
  template <typename Fn>
  static void ForWall(double turned, Fn&& fn) {
    for (double y = -0.975; y < 1; y += kVoxel) {
      for (double z = kHeight - 0.975; z < kHeight + 1; z += kVoxel) {
        SurfaceVoxel surface;
        surface.centroid = Eigen::Vector3d(kWall, y, z).cast<float>();
        surface.normal = Eigen::Vector3d(-std::cos(turned), std::sin(turned), 0).cast<float>();
        fn(surface);
      }
    }
  }
  // What is nearer to the border than a voxel, or than rays are apart, may be either. m.
  static double InDoubt() { return std::max(kVoxel, 1.5 * GetParam().step * kWall); }

  parallel::Serial serial_;
};

TEST_P(DropoutsAtThreeScanners, AreWhereNothingCameBack) {
  const std::unique_ptr<ScanLayer> layer = Layer();
  int within = 0;
  int beside = 0;
  ForWall(0, [&](const SurfaceVoxel& surface) {
    const double off = FromTheBorder(surface.centroid.cast<double>());
    if (std::abs(off) < InDoubt()) return;
    const bool dropped = IsDropout(*layer, surface, kVoxel);
    EXPECT_EQ(dropped, off < 0) << surface.centroid.transpose();
    ++(off < 0 ? within : beside);
  });
  EXPECT_GT(within, 100);
  EXPECT_GT(beside, 400);
}

// What may be left out beforehand has none.
TEST_P(DropoutsAtThreeScanners, BricksWithoutAnyHaveNone) {
  const std::unique_ptr<ScanLayer> layer = Layer();
  int left_out = 0;
  ForWall(0, [&](const SurfaceVoxel& surface) {
    const Eigen::Vector3d at = surface.centroid.cast<double>();
    const VoxelIndex voxel = (at / kVoxel).array().floor().cast<int>();
    if (MayHaveDropouts(*layer, Brick::Of(voxel), kVoxel)) return;
    ++left_out;
    EXPECT_FALSE(IsDropout(*layer, surface, kVoxel)) << at.transpose();
  });
  EXPECT_GT(left_out, 50);
}

// Beyond the maximum incidence rays are not expected back.
TEST_P(DropoutsAtThreeScanners, AskewSurfaceHasNone) {
  const std::unique_ptr<ScanLayer> layer = Layer();
  const double off = layer->scanner.max_incidence + sensor::Radians(9);
  ForWall(off, [&](const SurfaceVoxel& surface) {
    const Eigen::Vector3d to_scanner =
        Eigen::Vector3d(0, 0, kHeight) - surface.centroid.cast<double>();
    const double cosine = std::abs(surface.normal.cast<double>().dot(to_scanner.normalized()));
    if (cosine < std::cos(layer->scanner.max_incidence)) {
      EXPECT_FALSE(IsDropout(*layer, surface, kVoxel)) << surface.centroid.transpose();
    }
  });
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, DropoutsAtThreeScanners,
                         testing::ValuesIn(test_support::kThreeScanners));

}  // namespace
}  // namespace vantage::model
