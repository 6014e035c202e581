// Outdoor scenes are open above, can be scanned from their starts, and are the same everywhere.
#include "core/simulation/scenes/outdoor_scenes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "core/simulation/simulated_scanner.h"
#include "core/simulation/standable_positions.h"
#include "core/simulation/walkable_ground.h"

namespace vantage::simulation {
namespace {

using Build = Scene (*)(uint64_t);

class OutdoorSceneTest : public testing::TestWithParam<Build> {};

TEST_P(OutdoorSceneTest, HasFreeStartsUnderTheSky) {
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const Scene scene = GetParam()(seed);
    SCOPED_TRACE(scene.name);
    const SimulatedScanner tracer(scene.mesh);
    ASSERT_GE(scene.starts.size(), 2u);
    for (const Eigen::Vector3d& start : scene.starts) {
      EXPECT_GT(tracer.Clearance(start, 1), 0.5);
      const TraceHit above =
          tracer.tracer().Trace(start.cast<float>(), Eigen::Vector3f::UnitZ(), 0);
      EXPECT_FALSE(above.hit);
      const TraceHit below =
          tracer.tracer().Trace(start.cast<float>(), -Eigen::Vector3f::UnitZ(), 0);
      ASSERT_TRUE(below.hit);
      EXPECT_NEAR(below.distance, 1.5, 0.15);  // parts of the slope are flat, a metre long
    }
    const Scene again = GetParam()(seed);
    EXPECT_EQ(again.mesh.vertices, scene.mesh.vertices);
    EXPECT_NE(GetParam()(seed + 1).mesh.vertices, scene.mesh.vertices);
  }
}

TEST_P(OutdoorSceneTest, PlacesToStandAreOverTheGroundAndHangTogether) {
  const Scene scene = GetParam()(1);
  const SimulatedScanner tracer(scene.mesh);
  const double spacing = 1.0;
  const auto places =
      WalkableGround(tracer, scene.mesh.Bounds(), scene.starts[0]).Stations(1.5, 0.35, spacing);
  EXPECT_GT(places.size(), 50u);
  for (const Eigen::Vector3d& place : places) {
    const TraceHit below = tracer.tracer().Trace(place.cast<float>(), -Eigen::Vector3f::UnitZ(), 0);
    ASSERT_TRUE(below.hit);
    EXPECT_NEAR(below.distance, 1.5, 1e-3);
    EXPECT_GT(tracer.Clearance(place, 1), 0.34);
    // Nobody stands on a roof: those are higher than any ground beside them by more than a step.
    EXPECT_LT(std::abs(place.z() - scene.starts[0].z()), 3);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, OutdoorSceneTest,
                         testing::Values(FacadeScene, CourtyardScene, StreetScene, SlopeScene));

// On level ground both ways of finding places find the same, up to the lattices' roundings.
TEST(OutdoorStationsTest, AreTheOnesOfOneFloorWhereItIsLevel) {
  const Scene scene = CourtyardScene(3);
  const SimulatedScanner tracer(scene.mesh);
  const auto bounds = scene.mesh.Bounds();
  const auto level = StandablePositions(tracer, bounds, scene.starts[0], 0, 1.5, 0.35, 1.0);
  const auto ground = WalkableGround(tracer, bounds, scene.starts[0]).Stations(1.5, 0.35, 1.0);
  EXPECT_GT(level.size(), 80u);
  std::set<std::pair<long, long>> places;
  const auto key = [](const Eigen::Vector3d& p) {
    return std::pair(std::lround(100 * p.x()), std::lround(100 * p.y()));
  };
  for (const Eigen::Vector3d& p : level) places.insert(key(p));
  size_t shared = 0;
  for (const Eigen::Vector3d& p : ground) shared += places.contains(key(p)) ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(shared), static_cast<double>(level.size()),
              0.05 * static_cast<double>(level.size()));
  EXPECT_NEAR(static_cast<double>(ground.size()), static_cast<double>(level.size()),
              0.05 * static_cast<double>(level.size()));
}

}  // namespace
}  // namespace vantage::simulation
