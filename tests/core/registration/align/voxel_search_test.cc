// Compares the search by masks with a search of every voxel.
#include "core/registration/align/voxel_search.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

std::optional<model::SurfaceVoxel> NearestOfAll(const model::PlanningView& model,
                                                const Eigen::Vector3d& point,
                                                const Eigen::Vector3d& normal, double reach) {
  std::optional<model::SurfaceVoxel> best;
  double nearest = reach * reach * model.voxel_size() * model.voxel_size();
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        const double distance = (point - voxel.centroid.cast<double>()).squaredNorm();
        if (state != model::VoxelState::kTrueSurface || distance >= nearest) return;
        if (voxel.normal.cast<double>().dot(normal) < 0.8) return;
        nearest = distance;
        best = voxel;
      });
  return best;
}

TEST(VoxelSearch, FindsWhatALookAtAllVoxelsFinds) {
  ScanSettings coarse;
  coarse.step = sensor::Radians(1.5);
  const auto model = ModelOf(FurnishedRoom(2), PoseAt({-1.0, -0.6, 1.4}, 0.3), coarse, 0.03, 7);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-4, -3, -1), Eigen::Vector3d(4, 3, 3));
  const VoxelSearch search(*model, box);
  std::mt19937_64 random(11);
  std::normal_distribution<double> off(0, 0.05);
  size_t at = 0;
  size_t found = 0;
  model->ForEachSurface([&](const model::VoxelIndex&, model::VoxelState state,
                            const model::SurfaceVoxel& voxel) {
    if (state != model::VoxelState::kTrueSurface || ++at % 41 != 0) return;
    const Eigen::Vector3d point =
        voxel.centroid.cast<double>() + Eigen::Vector3d(off(random), off(random), off(random));
    const Eigen::Vector3d normal =
        (voxel.normal.cast<double>() + 5 * Eigen::Vector3d(off(random), off(random), off(random)))
            .normalized();
    for (const double reach : {kFineReach, kWidestReach}) {
      const std::optional<model::SurfaceVoxel> expected =
          NearestOfAll(*model, point, normal, reach);
      EXPECT_EQ(search.FindsAny(point, normal, reach), expected.has_value());
      const Match match = search.Find(point, normal, reach);
      ASSERT_EQ(match.voxel != nullptr, expected.has_value()) << point.transpose();
      if (!expected.has_value()) continue;
      EXPECT_EQ(match.voxel->centroid, expected->centroid) << point.transpose();
      EXPECT_EQ(match.voxel->normal, expected->normal) << point.transpose();
      ++found;
    }
  });
  EXPECT_GT(found, 100U);
}

TEST(VoxelSearch, FindsNothingFarFromItsBox) {
  const auto model = ModelOf(BareRoom(), PoseAt({0, 0, 1.4}, 0), {}, 0, 7);
  const VoxelSearch away(*model, {Eigen::Vector3d(20, 20, 0), Eigen::Vector3d(21, 21, 1)});
  EXPECT_EQ(away.Find({0, 0, 0}, Eigen::Vector3d::UnitZ()).voxel, nullptr);
  const VoxelSearch nowhere(*model, Eigen::AlignedBox3d());
  EXPECT_EQ(nowhere.Find({0, 0, 0}, Eigen::Vector3d::UnitZ()).voxel, nullptr);
}

}  // namespace
}  // namespace vantage::registration
