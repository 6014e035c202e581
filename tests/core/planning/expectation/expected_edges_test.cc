// Nobody is sent into the air, where places are expected and not known either: against the mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "core/parallel/thread_pool.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "tests/support/standing_oracle.h"

namespace vantage::planning {
namespace {

// Scenes whose starts see every doorway from both sides: nothing is expected there.
constexpr std::array<std::string_view, 2> kNothingExpected = {"stairwell edge", "platform"};

// Number of expected places.
size_t ExpectOnTheFloor(const simulation::Scene& scene) {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
  PlanningConfig config;
  config.station_basis = StationBasis::kExpected;
  parallel::ThreadPool pool(2);
  const auto model = test_support::ScanFromStarts(scene, scanner, pool);
  const auto problem = PlanningProblem::Prepare({*model, scanner, config}, pool).value();
  const test_support::StandingFigures figures =
      test_support::JudgeStanding(scene, *model, problem->feasible(), scanner, config);
  size_t expected = 0;
  for (size_t i = 0; i < problem->feasible().cells().size(); ++i) {
    const Eigen::Vector3d place = problem->feasible().Centre(i);
    expected += problem->BasisOf(place) == StationBasis::kExpected ? 1 : 0;
  }
  std::printf("%s: %zu views, %zu of them expected, %zu in the air\n", scene.name.c_str(),
              figures.feasible, expected, figures.in_air);
  EXPECT_EQ(figures.in_air, 0u);
  for (const Eigen::Vector3d& p : figures.air) ADD_FAILURE() << "in the air: " << p.transpose();
  return expected;
}

class ExpectedEdgesTest : public ::testing::TestWithParam<size_t> {};

TEST_P(ExpectedEdgesTest, ViewsStandOnTheFloor) {
  const simulation::Scene scene = simulation::EdgeScenes()[GetParam()];
  const size_t expected = ExpectOnTheFloor(scene);
  if (std::find(kNothingExpected.begin(), kNothingExpected.end(), scene.name) ==
      kNothingExpected.end()) {
    EXPECT_GT(expected, 0u) << "or this says nothing of expected places";
  }
}
INSTANTIATE_TEST_SUITE_P(Edges, ExpectedEdgesTest, ::testing::Range(size_t{0}, size_t{12}),
                         [](const auto& scene) {
                           std::string name = simulation::EdgeScenes()[scene.param].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

class RandomExpectedEdgesTest : public ::testing::TestWithParam<uint64_t> {};

TEST_P(RandomExpectedEdgesTest, ViewsStandOnTheFloor) {
  ExpectOnTheFloor(simulation::RandomEdgeScene(GetParam()));
}
// The last six: ways over shadows once led to places of which only the shadow was known.
INSTANTIATE_TEST_SUITE_P(Seeds, RandomExpectedEdgesTest,
                         ::testing::Values(uint64_t{1}, 2, 3, 4, 314, 324, 328, 339, 349, 421));

}  // namespace
}  // namespace vantage::planning
