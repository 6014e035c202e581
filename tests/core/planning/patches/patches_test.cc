#include "core/planning/patches/patches.h"

#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using Key = std::tuple<int, int, int>;
Key KeyOf(const model::VoxelIndex& v) { return {v.x(), v.y(), v.z()}; }

class PatchesTest : public ::testing::TestWithParam<int> {};

TEST_P(PatchesTest, EveryDeficientVoxelIsInExactlyOnePlanarPatchOfItsKind) {
  const model::PlanningView model =
      test_support::BuildView(test_support::FurnishedRoom(static_cast<uint64_t>(GetParam())));
  PlanningConfig config;
  config.unknown_depth = 0;  // what is lacking is D - q
  const PatchTolerance tolerance;
  const PatchSet set =
      RankPatches(config, ExtractPatches(model, config, tolerance).value()).value();

  std::map<Key, model::SurfaceKind> deficient;
  double area = 0;
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state == model::VoxelState::kTrueSurface && surface.density >= 2500) return;
        deficient[KeyOf(v)] = model::KindOf(state);
        area += surface.area;
      });
  ASSERT_EQ(set.cells.size(), deficient.size());
  EXPECT_NEAR(set.area, area, 1e-6 * area);
  ASSERT_GT(set.patches.size(), 5u);

  uint32_t next = 0;
  double importance = set.patches.front().importance;
  for (const Patch& patch : set.patches) {
    EXPECT_LE(patch.importance, importance);
    importance = patch.importance;
    double own_area = 0;
    double deficit = 0;
    const Eigen::Vector3d axis_v = patch.normal.cross(patch.axis_u);
    EXPECT_NEAR(patch.normal.dot(patch.axis_u), 0, 1e-9);
    EXPECT_GE(patch.length_u, patch.length_v);
    for (const uint32_t i : patch.cells) {
      ASSERT_EQ(i, next++);  // side by side, each once
      const DeficientCell& cell = set.cells[i];
      const auto it = deficient.find(KeyOf(cell.voxel));
      ASSERT_NE(it, deficient.end());
      EXPECT_EQ(it->second, patch.kind);
      deficient.erase(it);
      own_area += cell.area;
      deficit += (2500.0 - static_cast<double>(cell.density)) * static_cast<double>(cell.area);
      const Eigen::Vector3d d = cell.position.cast<double>() - patch.centre;
      // Both the plane that grew it and the fitted one are within the tolerance of every cell.
      EXPECT_LT(std::abs(d.dot(patch.normal)), 0.35 * patch.length_u + 2 * tolerance.offset * 0.05);
      EXPECT_GT(cell.normal.cast<double>().dot(patch.normal), std::cos(2 * tolerance.angle));
      EXPECT_LE(std::abs(d.dot(patch.axis_u)), patch.length_u / 2 + 1e-9);
      EXPECT_LE(std::abs(d.dot(axis_v)), patch.length_v / 2 + 1e-9);
    }
    EXPECT_NEAR(patch.area, own_area, 1e-6);
    EXPECT_NEAR(patch.deficit, deficit, 1e-3 * deficit + 1e-6);
  }
  EXPECT_TRUE(deficient.empty());
}
INSTANTIATE_TEST_SUITE_P(Seeds, PatchesTest, ::testing::Range(1, 5));

TEST(PatchesOfABoxTest, AWallIsOnePatchWithItsMeasures) {
  test_support::ClosedFormScene scene;
  const Eigen::AlignedBox3d room(Eigen::Vector3d::Zero(), Eigen::Vector3d(3, 2, 1.5));
  scene.extent = Eigen::AlignedBox3d(room.min().array() - 0.1, room.max().array() + 0.1);
  scene.solid = [=](const Eigen::Vector3d& p) { return !room.contains(p); };
  scene.density = [](const Eigen::Vector3d& p) { return p.x() < 0 ? 500 : 5000; };
  const model::PlanningView model = test_support::BuildView(scene);
  PlanningConfig config;
  const PatchSet set = RankPatches(config, ExtractPatches(model, config).value()).value();
  // The wall at x = 0; its rim has tilted normals and may be patches of its own.
  const Patch& wall = set.patches.front();
  EXPECT_NEAR(wall.normal.x(), 1, 1e-6);
  EXPECT_NEAR(wall.length_u, 2, 0.1001);
  EXPECT_NEAR(wall.length_v, 1.5, 0.1001);
  EXPECT_NEAR(wall.area, wall.length_u * wall.length_v, 1e-3);
  EXPECT_NEAR(wall.mean_density, 500, 1e-3);
  EXPECT_NEAR(wall.deficit, 2000 * wall.area, 1e-2);
  EXPECT_NEAR(wall.centre.y(), 1, 0.01);
}

TEST(PatchesRegionTest, SurfaceOutsideTheRegionOrGivenUpDoesNotCount) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(1));
  PlanningConfig config;
  config.region_of_interest = Region(Eigen::Vector3d(1, 1, -1), Eigen::Vector3d(3, 3, 3));
  const PatchSet set = ExtractPatches(model, config).value();
  EXPECT_FALSE(set.cells.empty());
  for (const DeficientCell& cell : set.cells) {
    EXPECT_TRUE(config.region_of_interest->contains(cell.position.cast<double>()));
  }
}

TEST(SuccessProbabilityTest, FallsWithFailures) {
  EXPECT_EQ(SuccessProbability(0), 1);
  EXPECT_NEAR(SuccessProbability(1), 2.0 / 3, 1e-12);
  EXPECT_NEAR(SuccessProbability(2), 0.5, 1e-12);
}

}  // namespace
}  // namespace vantage::planning
