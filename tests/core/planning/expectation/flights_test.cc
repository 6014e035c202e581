// Stairs that lead to storeys that nobody has entered, against generated houses and scenes without.
#include "core/planning/expectation/flights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/planning/expectation/expectation.h"
#include "core/planning/openings/openings.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/house.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/support/standing_oracle.h"

namespace vantage::planning {
namespace {

constexpr double kStoreyHeight = 2.8;  // m, of the houses

class FlightsTest : public ::testing::Test {
 protected:
  FlightsTest() { scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4); }

  std::vector<Flight> FindIn(const model::PlanningView& model) const {
    const FloorMap floor = FloorMap::Find(model, std::nullopt).value();
    return FindFlights(model, floor, {}).value();
  }
  std::shared_ptr<const model::PlanningView> ScanFrom(simulation::Scene scene,
                                                      const std::vector<Eigen::Vector3d>& places) {
    scene.starts = places;
    return test_support::ScanFromStarts(scene, scanner_, pool_);
  }

  sensor::ScannerModel scanner_;
  parallel::ThreadPool pool_{2};
};

TEST_F(FlightsTest, LeadFromTheHallToTheNextStorey) {
  size_t found = 0;
  for (const uint64_t seed : {1, 2, 3}) {
    const simulation::Scene house = simulation::HouseOfThreeStoreys(seed);
    SCOPED_TRACE(house.name);
    const simulation::SimulatedScanner tracer(house.mesh);
    const double storey = house.starts[0].z() - 1.5;
    const auto model = ScanFrom(house, {house.starts[0]});
    for (const Flight& flight : FindIn(*model)) {
      ++found;
      EXPECT_NEAR(flight.storey_floor, kStoreyHeight * std::round(storey / kStoreyHeight), 0.1);
      EXPECT_NEAR(std::abs(flight.other_floor - flight.storey_floor), kStoreyHeight, 0.1);
      EXPECT_EQ(flight.up(), flight.end.z() > flight.storey_floor);
      const Eigen::Vector3f over = (flight.end + Eigen::Vector3d(0, 0, 0.5)).cast<float>();
      const simulation::TraceHit hit = tracer.tracer().Trace(over, {0, 0, -1}, 0);
      ASSERT_TRUE(hit.hit);
      EXPECT_NEAR(hit.distance, 0.5f, 0.2f) << "no step is there";
    }
  }
  EXPECT_GE(found, 1u);
}

TEST_F(FlightsTest, ThereAreNoneInAFlatAndOnPlatforms) {
  const simulation::Scene flat = simulation::FurnishedFlat(1);
  EXPECT_TRUE(FindIn(*ScanFrom(flat, flat.starts)).empty());
  for (const simulation::Scene& scene : simulation::EdgeScenes()) {
    if (scene.name != "step" && scene.name != "pit" && scene.name != "mezzanine" &&
        scene.name != "stairwell edge") {
      continue;
    }
    for (const Flight& flight : FindIn(*test_support::ScanFromStarts(scene, scanner_, pool_))) {
      ADD_FAILURE() << scene.name << ": " << flight.end.transpose();
    }
  }
}

TEST_F(FlightsTest, WhereAStoreyWasEnteredNoneLeadsThere) {
  for (const simulation::Scene& scene : simulation::EdgeScenes()) {
    if (scene.name != "house") continue;
    EXPECT_FALSE(FindIn(*ScanFrom(scene, {scene.starts[1]})).empty()) << "half-way up";
    // A start on either storey, and between them.
    EXPECT_TRUE(FindIn(*test_support::ScanFromStarts(scene, scanner_, pool_)).empty());
  }
}

// The storey beyond is expected where nothing is known, and nobody is sent there.
TEST_F(FlightsTest, WhatIsExpectedBeyondContradictsNothingAndIsNoPlaceToStand) {
  size_t expected = 0;
  for (const uint64_t seed : {1, 2, 3}) {
    const simulation::Scene house = simulation::HouseOfThreeStoreys(seed);
    SCOPED_TRACE(house.name);
    const auto model = ScanFrom(house, {house.starts[0]});
    const std::vector<Flight> flights = FindIn(*model);
    if (flights.empty()) continue;
    PlanningConfig config;
    config.station_basis = StationBasis::kExpected;
    const auto problem = PlanningProblem::Prepare({*model, scanner_, config}, pool_).value();
    const Expectation& expectation = *problem->expectation();
    const model::VoxelBox& box = expectation.view().bounds();
    for (int z = box.min.z(); z < box.max.z(); ++z) {
      for (int y = box.min.y(); y < box.max.y(); ++y) {
        for (int x = box.min.x(); x < box.max.x(); ++x) {
          const model::VoxelIndex v(x, y, z);
          if (!expectation.Expected(v)) continue;
          const model::VoxelState known = model->State(v);
          ASSERT_TRUE(known == model::VoxelState::kUnknown || model::IsFalseSurface(known));
          for (const Flight& flight : flights) {
            const double over = model->Centre(v).z() - flight.other_floor;
            expected += over > 0.1 && over < 2.4 ? 1 : 0;
          }
        }
      }
    }
    for (const Flight& flight : flights) {
      for (size_t i = 0; i < problem->feasible().cells().size(); ++i) {
        const Eigen::Vector3d view = problem->feasible().Centre(i);
        const double floor = view.z() - problem->feasible().HeightOverFloor(view);
        ASSERT_GT(std::abs(floor - flight.other_floor), 0.1) << view.transpose();
      }
    }
  }
  EXPECT_GT(expected, 10'000u);
}

}  // namespace
}  // namespace vantage::planning
