#include "core/simulation/walkable_ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "core/simulation/scenes/edge_scenes.h"
#include "core/simulation/scenes/house.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/standable_positions.h"

namespace vantage::simulation {
namespace {

Scene Edge(const std::string& name) {
  for (Scene& scene : EdgeScenes()) {
    if (scene.name == name) return scene;
  }
  ADD_FAILURE() << name;
  return {};
}

WalkableGround GroundOf(const SimulatedScanner& tracer, const Scene& scene) {
  return {tracer, scene.mesh.Bounds(), scene.starts.front()};
}

// Stations by the height of the floor below them, in cm.
std::map<int, int> Levels(const WalkableGround& ground) {
  std::map<int, int> levels;
  for (const Eigen::Vector3d& station : ground.Stations(1.5, 0.35, 0.25)) {
    ++levels[static_cast<int>(std::lround(100 * (station.z() - 1.5)))];
  }
  return levels;
}

TEST(WalkableGround, IsWhereATripodStandsOnOneFloor) {
  // The other way of finding them, which knows one floor only.
  const Scene scene = TwoRooms(4);
  const SimulatedScanner tracer(scene.mesh);
  const auto expected =
      StandablePositions(tracer, scene.mesh.Bounds(), scene.starts.front(), 0, 1.5, 0.35, 0.25);
  auto found = GroundOf(tracer, scene).Stations(1.5, 0.35, 0.25);
  ASSERT_GT(expected.size(), 20u);
  const auto has = [](const std::vector<Eigen::Vector3d>& all, const Eigen::Vector3d& one) {
    return std::any_of(all.begin(), all.end(),
                       [&](const auto& p) { return (p - one).norm() < 0.02; });
  };
  for (const Eigen::Vector3d& p : expected) EXPECT_TRUE(has(found, p)) << p.transpose();
  for (const Eigen::Vector3d& p : found) EXPECT_TRUE(has(expected, p)) << p.transpose();
}

TEST(WalkableGround, StairsLeadUpAndDropsDoNot) {
  const Scene house = Edge("house");
  const SimulatedScanner tracer(house.mesh);
  const std::map<int, int> levels = Levels(GroundOf(tracer, house));
  EXPECT_GT(levels.at(0), 100);
  EXPECT_GT(levels.at(140), 5) << "the landing";
  EXPECT_GT(levels.at(280), 100);
  EXPECT_EQ(levels.size(), 3u) << "nobody stands on a step";

  const Scene apart = Edge("two storeys");
  const SimulatedScanner apart_tracer(apart.mesh);
  EXPECT_EQ(Levels(GroundOf(apart_tracer, apart)).size(), 1u);
  const Scene platform = Edge("platform");
  const SimulatedScanner platform_tracer(platform.mesh);
  for (const Eigen::Vector3d& p : GroundOf(platform_tracer, platform).Stations(1.5, 0.35, 0.25)) {
    EXPECT_NEAR(p.z(), 1.5, 0.01);
    // All four feet are on it.
    EXPECT_LE((p.head<2>().array() - 2.5).abs().maxCoeff(), 2.5 - 0.25 + 0.01);
  }
}

TEST(WalkableGround, OfTheHouseLeadsFromTheStreetDoorToTheAttic) {
  for (const uint64_t seed : {1, 2, 3, 201, 202}) {
    SCOPED_TRACE(seed);
    const Scene house = HouseOfThreeStoreys(seed);
    const SimulatedScanner tracer(house.mesh);
    const std::map<int, int> levels = Levels(GroundOf(tracer, house));
    for (const int storey : {0, 280, 560}) EXPECT_GT(levels.at(storey), 100) << storey;
    for (const int landing : {140, 420}) EXPECT_GT(levels.at(landing), 2) << landing;
  }
}

TEST(WalkableGround, AStepOfAStairIsFoundFromBelowAndAbove) {
  const Scene house = Edge("house");
  const SimulatedScanner tracer(house.mesh);
  const WalkableGround ground = GroundOf(tracer, house);
  for (size_t i = 0; i < ground.places().size(); ++i) {
    for (const size_t next : ground.Around(i)) {
      const std::vector<size_t> back = ground.Around(next);
      EXPECT_NE(std::find(back.begin(), back.end(), i), back.end());
    }
  }
}

}  // namespace
}  // namespace vantage::simulation
