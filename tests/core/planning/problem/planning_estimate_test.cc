// What a plan is said to take, against what it takes.
#include "core/planning/problem/planning_estimate.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/large_hall.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/resident_memory.h"

namespace vantage::planning {
namespace {

// A scene after a scan from its first start: little of it has the density that is wanted.
std::shared_ptr<const model::PlanningView> AfterAScan(const simulation::Scene& scene,
                                                      const sensor::ScannerModel& scanner,
                                                      double voxel) {
  parallel::ThreadPool pool(2);
  const simulation::SimulatedScanner tracer(scene.mesh);
  sensor::Scan scan;
  scan.scanner = scanner;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = scene.starts.front();
  scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, 1, pool);
  model::ModelConfig config;
  config.voxel_size = voxel;
  const auto model = model::PartialModel::Create(config).value();
  (void)model->Insert("scan", scan, pose, pool).value();
  return model->Publish();
}

struct Case {
  const char* name;
  simulation::Scene (*scene)(uint64_t seed);
  double range;  // m
  double voxel;  // m
};

class PlanningEstimateOfScansTest : public testing::TestWithParam<Case> {};

TEST_P(PlanningEstimateOfScansTest, IsWithinAFifthOfWhatAPlanTakes) {
  if (!test_support::ResetPeak()) GTEST_SKIP() << "the peak of memory is not known here";
  sensor::ScannerModel scanner;
  scanner.range_max = GetParam().range;
  const auto model = AfterAScan(GetParam().scene(1), scanner, GetParam().voxel);
  PlanningConfig config;
  config.viewcell_size = 4 * GetParam().voxel;
  parallel::Serial serial;
  ASSERT_TRUE(test_support::ResetPeak());
  const double before = test_support::ResidentMegabytes();
  const auto problem = PlanningProblem::Prepare({*model, scanner, config}, serial).value();
  // Enough that the trees of step D are built.
  parallel::Budget budget;
  budget.work_limit = 20'000'000;
  const Plan plan = MakePlan(*problem, budget, serial, [](const Plan&) {});
  const double taken = 1e6 * (test_support::PeakMegabytes() - before);
  EXPECT_FALSE(plan.views.empty());
  ASSERT_GT(taken, 50e6);
  const PlanningSize size(*model, config);
  const auto estimate =
      static_cast<double>(size.Bytes(static_cast<double>(problem->feasible().cells().size())));
  EXPECT_LT(estimate, 1.2 * taken);
  EXPECT_GT(estimate, taken / 1.2);
  std::printf("%.1f MB taken, %.1f MB estimated: %zu views, %zu cells\n", taken / 1e6,
              estimate / 1e6, plan.feasible_cells, plan.deficient_cells);
}

INSTANTIATE_TEST_SUITE_P(Scenes, PlanningEstimateOfScansTest,
                         testing::Values(Case{"Flat", simulation::FurnishedFlat, 20, 0.02},
                                         Case{"Hall", simulation::LargeHall, 50, 0.1}),
                         [](const auto& of) { return of.param.name; });

TEST(PlanningEstimateTest, CountsWhatHasToBeScanned) {
  test_support::ClosedFormScene scene = test_support::FurnishedRoom(2);
  scene.density = [](const Eigen::Vector3d&) { return 0.0; };
  PlanningConfig config;
  const auto bytes = [&] { return PlanningSize(test_support::BuildView(scene), config).Bytes(0); };
  const uint64_t all = bytes();
  config.required_density = 1000;
  scene.density = [](const Eigen::Vector3d& p) { return p.x() < 3 ? 2000.0 : 0.0; };
  const uint64_t half = bytes();
  EXPECT_LT(half, all);
  config.required_density = 2500;  // more than any has
  EXPECT_EQ(bytes(), all);
  config.region_of_interest = Region(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1));
  EXPECT_LT(bytes(), half);
}

TEST(PlanningEstimateTest, GrowsWithTheViews) {
  const model::PlanningView model = test_support::BuildView(test_support::FurnishedRoom(2));
  const PlanningConfig config;
  const PlanningSize size(model, config);
  parallel::Serial serial;
  const sensor::ScannerModel scanner;
  const auto problem = PlanningProblem::Prepare({model, scanner, config}, serial).value();
  const auto views = static_cast<double>(problem->feasible().cells().size());
  EXPECT_GT(views, 0);
  EXPECT_LE(views, size.most_views());
  EXPECT_LT(size.Bytes(views), size.Bytes(2 * views));
  EXPECT_EQ(EstimatePlanningMemory(model, config), size.Bytes(size.most_views()));
}

}  // namespace
}  // namespace vantage::planning
