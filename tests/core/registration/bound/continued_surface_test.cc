// What is taken to lie beyond what is known.
#include "core/registration/bound/continued_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/registration/align/scan_surface.h"
#include "core/sensor/scan.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

// The known surface of a model that is near a place, as a forecast has it.
std::vector<SurfaceSample> SeenFrom(const model::PlanningView& model,
                                    const Eigen::Vector3d& position) {
  std::vector<SurfaceSample> seen;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        const Eigen::Vector3d ray = voxel.centroid.cast<double>() - position;
        if (state != model::VoxelState::kTrueSurface || ray.norm() > 6) return;
        if (!(-voxel.normal.cast<double>().dot(ray) > 0.3 * ray.norm())) return;
        SurfaceSample sample;
        sample.point = ray.cast<float>();
        sample.normal = voxel.normal;
        sample.cells = 1;
        seen.push_back(sample);
      });
  SpreadSamples(seen);
  return seen;
}

TEST(ContinuedSurface, ACorridorGoesOnWhereItsScansEnd) {
  const BoxScene scene = Corridor();
  const auto model = ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 3);
  double end = 0;  // m, along x, of what is known
  model->ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state == model::VoxelState::kTrueSurface) {
          end = std::max<double>(end, voxel.centroid.x());
        }
      });
  const Eigen::Vector3d at(end - 2, 0.1, 1.4);
  const std::vector<SurfaceSample> beyond =
      ContinuedSurface(*model, SeenFrom(*model, at), at, sensor::ScannerModel());
  EXPECT_GT(beyond.size(), 100u);
  size_t near_surface = 0;
  for (const SurfaceSample& s : beyond) {
    const Eigen::Vector3d point = at + s.point.cast<double>();
    const Eigen::Vector3d& low = scene.room.min();
    const Eigen::Vector3d& high = scene.room.max();
    const double off = std::min({std::abs(point.y() - low.y()), std::abs(point.y() - high.y()),
                                 std::abs(point.z() - low.z()), std::abs(point.z() - high.z())});
    near_surface += off < 0.05 ? 1 : 0;
    EXPECT_NE(model->State(model->At(point)), model::VoxelState::kTrueSurface);
    EXPECT_GT(s.cells, 0);
    EXPECT_LT(s.normal.dot(s.point), 0);
  }
  EXPECT_GT(near_surface, beyond.size() * 19 / 20);
}

TEST(ContinuedSurface, OfAClosedRoomNothingIsBeyond) {
  ScanSettings all_down;
  all_down.elevation_min = sensor::Radians(-89);
  const auto model = ModelFromScan(BareRoom(), PoseAt({0.3, 0.2, 1.4}, 0.4), all_down, 7);
  const Eigen::Vector3d at(-0.5, 0.4, 1.4);
  const std::vector<SurfaceSample> beyond =
      ContinuedSurface(*model, SeenFrom(*model, at), at, sensor::ScannerModel());
  EXPECT_LT(beyond.size(), 10u);
}

}  // namespace
}  // namespace vantage::registration
