#include "tests/support/closed_loop.h"

#include <gtest/gtest.h>

#include "core/simulation/counter_random.h"

namespace vantage {

LoopResult RunClosedLoop(
    const std::function<TriangleMesh(int scan, const Eigen::Vector3d& stand)>& mesh_of,
    const Eigen::Vector3d& start, const LoopOptions& options, Parallel& parallel) {
  LoopResult result;
  result.model = PartialModel::Create(options.model).value();
  Eigen::Vector3d stand = start;
  for (int i = 0; i < options.max_scans; ++i) {
    const SimulatedScanner simulated(mesh_of(i, stand));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(stand);
    pose.rotate(
        Eigen::AngleAxisd(2 * kPi * RandomUniform(options.seed, static_cast<uint64_t>(i), 1),
                          Eigen::Vector3d::UnitZ()));
    Scan scan;
    scan.scanner = options.scanner;
    scan.image = simulated.Scan(options.scanner, pose, options.faults,
                                options.seed * 1000 + static_cast<uint64_t>(i), parallel);
    const auto report = result.model->Insert("scan" + std::to_string(i), scan, pose, parallel);
    EXPECT_TRUE(report.ok()) << report.status();
    if (!report.ok()) return result;
    result.stands.push_back(stand);
    Budget budget;
    budget.work_limit = options.work_limit;
    auto plan = MakePlan(*result.model->Publish(), options.scanner, options.planning, budget,
                         parallel, [](const Plan&) {});
    EXPECT_TRUE(plan.ok()) << plan.status();
    if (!plan.ok()) return result;
    result.plans.push_back(*std::move(plan));
    const Plan& made = result.plans.back();
    if (made.termination.suggested) {
      result.stopped = true;
      return result;
    }
    if (!made.views.empty()) {
      stand = made.views.front().position;
    } else if (!made.refused.empty()) {
      stand = made.refused.front().position;
    } else {
      return result;
    }
  }
  return result;
}

}  // namespace vantage
