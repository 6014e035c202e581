// A range surface of which rays were left out, beside the one that has all.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/carve/carve.h"
#include "core/model/carve/thin_layer.h"
#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"
#include "core/parallel/thread_pool.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::model {
namespace {

sensor::Scan DoorwayScan(double degrees) {
  const ClosedFormScene scene = DoorwayRooms();
  return ScanScene(scene, PoseAt(scene.stations[0]), {.step = sensor::Radians(degrees)});
}

RangeSurface SurfaceOf(const sensor::Scan& scan) {
  parallel::Serial serial;
  return {scan.image, scan.scanner, ModelConfig().discontinuity_angle, serial};
}

TEST(ThinnedSurface, JoinsWhatWasJoinedAllTheWay) {
  const RangeSurface all = SurfaceOf(DoorwayScan(0.5));
  parallel::Serial serial;
  constexpr int kColumnStride = 4;
  constexpr int kRowStride = 3;
  const RangeSurface thinned = all.Thinned(kColumnStride, kRowStride, serial);
  ASSERT_EQ(all.columns() % kColumnStride, 0);  // so that the last gap is as wide as the others
  ASSERT_EQ(thinned.columns(), all.columns() / kColumnStride);
  const int first = (all.rows() - 1) % kRowStride / 2;
  size_t parted = 0;
  for (int c = 0; c < thinned.columns(); ++c) {
    for (int r = 0; r < thinned.rows(); ++r) {
      const int column = c * kColumnStride;
      const int row = first + r * kRowStride;
      ASSERT_EQ(thinned.at(c, r), all.at(column, row));
      bool right = true;
      for (int i = 0; i < kColumnStride; ++i) {
        right = right && all.JoinedToNextColumn((column + i) % all.columns(), row);
      }
      EXPECT_EQ(thinned.JoinedToNextColumn(c, r), right) << c << " " << r;
      if (r + 1 == thinned.rows()) continue;
      bool up = true;
      bool quad = true;
      for (int k = 0; k < kRowStride; ++k) {
        up = up && all.JoinedToNextRow(column, row + k);
        for (int i = 0; i < kColumnStride; ++i) {
          quad = quad && all.QuadJoined((column + i) % all.columns(), row + k);
        }
      }
      EXPECT_EQ(thinned.JoinedToNextRow(c, r), up) << c << " " << r;
      EXPECT_EQ(thinned.QuadJoined(c, r), quad) << c << " " << r;
      parted += quad ? 0 : 1;
    }
  }
  EXPECT_GT(parted, 20u);  // at the doorway's edges
  parallel::ThreadPool pool(3);
  const RangeSurface by_many = all.Thinned(kColumnStride, kRowStride, pool);
  for (int c = 0; c < thinned.columns(); ++c) {
    for (int r = 0; r < thinned.rows(); ++r) {
      ASSERT_EQ(by_many.QuadJoined(c, r), thinned.QuadJoined(c, r));
    }
  }
}

// What a layer of a dense scan answers, beside the scene itself.
TEST(ThinnedSurface, ALayerAnswersAsItsSceneDoesHoweverDenseTheScanWas) {
  const ClosedFormScene scene = DoorwayRooms();
  const Eigen::Isometry3d pose = PoseAt(scene.stations[0], 0.4, 0.01, -0.02);
  parallel::Serial serial;
  size_t bytes[2];
  for (const double degrees : {0.25, 0.0625}) {
    SCOPED_TRACE(degrees);
    const sensor::Scan scan = ScanScene(scene, pose, {.step = sensor::Radians(degrees)});
    const auto layer = Carve(scan, pose, ModelConfig(), serial);
    bytes[degrees < 0.1 ? 1 : 0] = layer->range_surface.bytes();
    EXPECT_EQ(static_cast<size_t>(layer->range_surface.columns() * layer->range_surface.rows()),
              KeptCells(scan.image));
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> within(-4, 4);
    size_t asked = 0;
    size_t right = 0;
    while (asked < 20'000) {
      const Eigen::Vector3d point =
          scene.stations[0] + Eigen::Vector3d(within(random), within(random), within(random) / 4);
      const Eigen::Vector3d to = point - scene.stations[0];
      const double distance = to.norm();
      const Eigen::Vector3d in_scan = pose.linear().transpose() * to;
      const double elevation = std::asin(in_scan.z() / distance);
      if (elevation < sensor::Radians(-59) || distance < 0.6) continue;
      const double sees = scene.Cast(scene.stations[0], to / distance, 30);
      if (std::abs(sees - distance) < 0.05) continue;  // at a surface
      ++asked;
      const UnknownReason truth =
          distance < sees ? UnknownReason::kNone : UnknownReason::kOcclusion;
      right += layer->ReasonAt(point) == truth ? 1 : 0;
    }
    EXPECT_GT(static_cast<double>(right), 0.995 * static_cast<double>(asked));
  }
  EXPECT_LT(static_cast<double>(bytes[1]), 1.1 * static_cast<double>(bytes[0]));
}

}  // namespace
}  // namespace vantage::model
