#include "tests/bench/flat_job.h"

#include <string>
#include <utility>

#include "core/planning/planner.h"
#include "core/simulation/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage {

FlatJob MakeFlatJob(uint64_t seed, size_t count, Parallel& parallel) {
  const Scene scene = FurnishedFlat(seed);
  const SimulatedScanner tracer(scene.mesh);
  const ScannerModel scanner;
  FlatJob job;
  auto model = PartialModel::Create({}).value();
  Eigen::Vector3d position = scene.starts[0];
  while (job.scans.size() < count) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(position);
    pose.rotate(
        Eigen::AngleAxisd(0.7 * static_cast<double>(job.scans.size()), Eigen::Vector3d::UnitZ()));
    Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, pose, ScanFaults{}, seed + job.scans.size(), parallel);
    model->Insert("scan" + std::to_string(job.scans.size()), scan, pose, parallel).value();
    job.scans.push_back(std::move(scan));
    job.poses.push_back(pose);
    if (job.scans.size() == count) break;
    // By work, not time: the same job on every machine.
    Budget budget;
    budget.work_limit = 4'000'000;
    const Plan plan =
        MakePlan(*model->Publish(), scanner, {}, budget, parallel, [](const Plan&) {}).value();
    position = plan.views.empty() ? scene.starts[job.scans.size() % scene.starts.size()]
                                  : plan.views[0].position;
  }
  return job;
}

std::unique_ptr<PartialModel> ModelOf(const FlatJob& job, size_t count, Parallel& parallel) {
  auto model = PartialModel::Create({}).value();
  for (size_t i = 0; i < count; ++i) {
    model->Insert("scan" + std::to_string(i), job.scans[i], job.poses[i], parallel).value();
  }
  return model;
}

}  // namespace vantage
