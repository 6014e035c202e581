#include "tests/bench/scan_job.h"

#include <string>
#include <utility>

#include "core/planning/plan/plan.h"
#include "core/planning/planner.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::bench {

ScanJob MakeScanJob(const simulation::Scene& scene, uint64_t seed, size_t count,
                    parallel::Parallel& parallel) {
  const simulation::SimulatedScanner tracer(scene.mesh);
  const sensor::ScannerModel scanner;
  ScanJob job;
  auto model = model::PartialModel::Create({}).value();
  Eigen::Vector3d position = scene.starts[0];
  while (job.scans.size() < count) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(position);
    pose.rotate(
        Eigen::AngleAxisd(0.7 * static_cast<double>(job.scans.size()), Eigen::Vector3d::UnitZ()));
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image =
        tracer.Scan(scanner, pose, simulation::ScanFaults{}, seed + job.scans.size(), parallel);
    model->Insert("scan" + std::to_string(job.scans.size()), scan, pose, parallel).value();
    job.scans.push_back(std::move(scan));
    job.poses.push_back(pose);
    if (job.scans.size() == count) break;
    // By work, not time: the same job on every machine.
    parallel::Budget budget;
    budget.work_limit = 4'000'000;
    const planning::Plan plan = planning::MakePlan(*model->Publish(), scanner, {}, budget, parallel,
                                                   [](const planning::Plan&) {})
                                    .value();
    position = plan.views.empty() ? scene.starts[job.scans.size() % scene.starts.size()]
                                  : plan.views[0].position;
  }
  return job;
}

ScanJob MakeFlatJob(uint64_t seed, size_t count, parallel::Parallel& parallel) {
  return MakeScanJob(simulation::FurnishedFlat(seed), seed, count, parallel);
}

std::unique_ptr<model::PartialModel> ModelOf(const ScanJob& job, size_t count,
                                             parallel::Parallel& parallel) {
  auto model = model::PartialModel::Create({}).value();
  for (size_t i = 0; i < count; ++i) {
    model->Insert("scan" + std::to_string(i), job.scans[i], job.poses[i], parallel).value();
  }
  return model;
}

}  // namespace vantage::bench
