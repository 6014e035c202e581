// Nobody is sent into the air, where places are expected and not known either: against the mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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

class ExpectedEdgesTest : public ::testing::TestWithParam<size_t> {};

TEST_P(ExpectedEdgesTest, ViewsStandOnTheFloor) {
  const simulation::Scene scene = simulation::EdgeScenes()[GetParam()];
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
  if (std::find(kNothingExpected.begin(), kNothingExpected.end(), scene.name) ==
      kNothingExpected.end()) {
    EXPECT_GT(expected, 0u) << "or this says nothing of expected places";
  }
  EXPECT_EQ(figures.in_air, 0u);
  for (const Eigen::Vector3d& p : figures.air) ADD_FAILURE() << "in the air: " << p.transpose();
}
INSTANTIATE_TEST_SUITE_P(Edges, ExpectedEdgesTest, ::testing::Range(size_t{0}, size_t{12}),
                         [](const auto& scene) {
                           std::string name = simulation::EdgeScenes()[scene.param].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
}  // namespace vantage::planning
