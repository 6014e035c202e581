#include "core/planning/patches/space_behind.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/planning/patches/patches.h"
#include "core/sensor/scanner_model.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/three_scanners.h"

namespace vantage::planning {
namespace {

constexpr double kVoxel = 0.05;

// Known-empty for x < 2, unknown for 2 < x < 3.5, known-empty again up to 4; above z = 1 a measured
// wall stands at x = 2.8. So false surface at x = 2 faces -x with 1.5 m or 0.8 m behind it.
test_support::ClosedFormScene Gap() {
  test_support::ClosedFormScene scene;
  scene.voxel = kVoxel;
  scene.extent = Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 2, 2));
  const auto wall = [](const Eigen::Vector3d& p) {
    return p.z() > 1 && p.x() > 2.8 && p.x() < 2.9;
  };
  scene.solid = wall;
  // The wall was seen from behind.
  scene.known = [wall](const Eigen::Vector3d& p) {
    return p.x() < 2 || p.x() > 3.5 || wall(p) || (p.z() > 1 && p.x() > 2.9);
  };
  return scene;
}

TEST(DepthBehindTest, IsTheDistanceToWhatIsKnown) {
  const model::PlanningView model = test_support::BuildView(Gap());
  int gaps = 0;
  int walls = 0;
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const Eigen::Vector3d at = model.Centre(v);
        // Away from edges, where normals are oblique.
        if (!model::IsFalseSurface(state) || at.x() < 2 || at.x() > 2.1 ||
            surface.normal.x() > -0.999f || std::abs(at.z() - 1) < 0.2) {
          return;
        }
        const double expected = at.z() < 1 ? 1.5 : 0.8;
        EXPECT_NEAR(DepthBehind(model, v, surface.normal, 10), expected, 1.01 * kVoxel);
        EXPECT_EQ(DepthBehind(model, v, surface.normal, 0.5), 0.5);
        ++(at.z() < 1 ? gaps : walls);
      });
  EXPECT_GT(gaps, 100);
  EXPECT_GT(walls, 100);
}

TEST(DepthBehindTest, EndsWithTheModel) {
  test_support::ClosedFormScene scene = Gap();
  scene.known = [](const Eigen::Vector3d& p) { return p.x() < 2; };
  const model::PlanningView model = test_support::BuildView(scene);
  const double end = model.bounds().max.x() * kVoxel;
  const model::VoxelIndex opening = model.At({2.02, 1, 0.5});
  ASSERT_TRUE(model::IsFalseSurface(model.State(opening)));
  EXPECT_NEAR(DepthBehind(model, opening, {-1, 0, 0}, 10), end - 2.05, kVoxel);
}

// The samples that pass through an opening and are worth having are those that a parallel surface
// behind it would still need: area grows with the square of the range as density falls.
// The range is one of rooms, so that this is so at any scanner that reaches D from there.
TEST(DensityWorthHavingTest, IsWhatSurfaceBehindNeedsAtTheLookingRange) {
  for (const test_support::ScannerCase& of : test_support::kThreeScanners) {
    SCOPED_TRACE(of.name);
    const sensor::ScannerModel scanner =
        test_support::Sector(of, 2 * sensor::kPi, sensor::Radians(60));
    for (const double depth : {0.0, 0.4, 1.0, 3.0}) {
      const double at_opening = scanner.SamplingDensity(0, 1, 2.0);
      const double behind = scanner.SamplingDensity(0, 1, 2.0 + depth);
      EXPECT_NEAR(DensityWorthHaving(behind, depth), at_opening, 1e-6 * at_opening);
      EXPECT_EQ(DepthWorth(behind, DensityWorthHaving(behind, depth)),
                1e-4 * std::round(1e4 * depth));
    }
  }
}

TEST(SpaceBehindTest, RaisesWhatFalseSurfaceIsWorthAndNothingElse) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(3));
  PlanningConfig config;
  config.unknown_depth = 0;
  const PatchSet paper = ExtractPatches(model, config).value();
  config.unknown_depth = 2;
  const PatchSet beyond = ExtractPatches(model, config).value();
  ASSERT_EQ(paper.cells.size(), beyond.cells.size());
  int raised = 0;
  for (size_t i = 0; i < paper.cells.size(); ++i) {
    ASSERT_EQ(paper.cells[i].enough, 2500.0f);
    if (paper.cells[i].kind == model::SurfaceKind::kTrue) {
      ASSERT_EQ(beyond.cells[i].enough, 2500.0f);
    } else {
      ASSERT_GE(beyond.cells[i].enough, 2500.0f);
      ASSERT_LE(beyond.cells[i].enough, 2500.0f * 4);
      raised += beyond.cells[i].enough > 2500;
    }
  }
  EXPECT_GT(raised, 100);
}

}  // namespace
}  // namespace vantage::planning
