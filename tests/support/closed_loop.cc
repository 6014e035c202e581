#include "tests/support/closed_loop.h"

#include <gtest/gtest.h>

#include "core/parallel/budget.h"
#include "core/planning/planner.h"
#include "core/simulation/random_sequence.h"

namespace vantage::test_support {

LoopResult RunClosedLoop(
    const std::function<simulation::TriangleMesh(int scan, const Eigen::Vector3d& station)>&
        mesh_of,
    const Eigen::Vector3d& start, const LoopOptions& options, parallel::Parallel& parallel) {
  LoopResult result;
  result.model = model::PartialModel::Create(options.model).value();
  Eigen::Vector3d station = start;
  for (int i = 0; i < options.max_scans; ++i) {
    const simulation::SimulatedScanner simulated(mesh_of(i, station));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(station);
    pose.rotate(Eigen::AngleAxisd(
        2 * sensor::kPi * simulation::RandomUniform(options.seed, static_cast<uint64_t>(i), 1),
        Eigen::Vector3d::UnitZ()));
    sensor::Scan scan;
    scan.scanner = options.scanner;
    scan.image = simulated.Scan(options.scanner, pose, options.faults,
                                options.seed * 1000 + static_cast<uint64_t>(i), parallel);
    const auto report = result.model->Insert("scan" + std::to_string(i), scan, pose, parallel);
    EXPECT_TRUE(report.ok()) << report.status();
    if (!report.ok()) return result;
    result.stations.push_back(station);
    parallel::Budget budget;
    budget.work_limit = options.work_limit;
    auto plan = planning::MakePlan(*result.model->Publish(), options.scanner, options.planning,
                                   budget, parallel, [](const planning::Plan&) {});
    EXPECT_TRUE(plan.ok()) << plan.status();
    if (!plan.ok()) return result;
    result.plans.push_back(*std::move(plan));
    const planning::Plan& made = result.plans.back();
    if (made.termination.suggested) {
      result.stopped = true;
      return result;
    }
    if (!made.views.empty()) {
      station = made.views.front().position;
    } else if (!made.refused.empty()) {
      station = made.refused.front().position;
    } else {
      return result;
    }
  }
  return result;
}

}  // namespace vantage::test_support
