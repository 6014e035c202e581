#include "client/simulated_job/walk_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/simulation/scenes/edge_scenes.h"

namespace vantage::simulated_job {
namespace {

TEST(WalkMap, OneFloorIsAroundTheWall) {
  const Site site = GeneratedSite(SceneKind::kTwoRooms, 1, 250, std::nullopt).value();
  const simulation::SimulatedScanner tracer(site.mesh);
  const WalkMap walks(tracer, site);
  const Eigen::Vector3d a = site.start;
  EXPECT_NEAR(walks.Distance(a, a), 0, 1e-9);
  EXPECT_NEAR(walks.Distance(a, a + Eigen::Vector3d(0.5, 0, 0)), 0.5, 0.15);
}

TEST(WalkMap, ToTheNextStoreyIsOverTheStairs) {
  Site site;
  for (simulation::Scene& scene : simulation::EdgeScenes()) {
    if (scene.name != "house") continue;
    site.start = scene.starts.front();
    site.mesh = std::move(scene.mesh);
    site.several_levels = true;
  }
  const simulation::SimulatedScanner tracer(site.mesh);
  const WalkMap walks(tracer, site);
  const Eigen::Vector3d below(0.7, 0.75, 1.5);
  const Eigen::Vector3d above(0.7, 2.25, 2.8 + 1.5);
  // Straight up it would be 1.5 m in plan; the two flights are 2 m long in plan each, the landing
  // is crossed, and it is 2.8 m up.
  const double up = walks.Distance(below, above);
  EXPECT_GT(up, 2 * std::hypot(1.96, 1.4) + 2);
  EXPECT_LT(up, 14);
  EXPECT_NEAR(walks.Distance(above, below), up, 1e-9);
  EXPECT_GT(walks.Way(below, above).size(), 30u);
}

}  // namespace
}  // namespace vantage::simulated_job
