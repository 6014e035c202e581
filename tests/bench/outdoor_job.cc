#include "tests/bench/outdoor_job.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/gain_cells.h"
#include "core/simulation/ground_truth.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/walkable_ground.h"

namespace vantage::bench {
namespace {

constexpr double kRangeMax = 40;          // m
constexpr double kStep = 0.25;            // degrees
constexpr double kDensity = 400;          // samples / m^2, 5 cm: reached from 11 m
constexpr double kLattice = 1.0;          // m between the places of the ground truth
constexpr size_t kTruthSamples = 20'000;  // points on the mesh
constexpr uint64_t kWork = 4'000'000;     // rays of a plan

// m^2 of a view's model gain in the sky.
double GainInSky(const planning::PlanningProblem& problem, const Eigen::Vector3d& view,
                 const simulation::Tracer& tracer) {
  const planning::CellArrays cells =
      planning::GainCells(problem.scoring().cells(), problem.patches());
  std::vector<float> gains(cells.size());
  problem.scoring().scorer().ScoreCells(view, cells, {}, gains);
  double sky = 0;
  for (size_t i = 0; i < gains.size(); ++i) {
    if (!(gains[i] > 0)) continue;
    const Eigen::Vector3f to =
        Eigen::Vector3f(cells.x[i], cells.y[i], cells.z[i]) - view.cast<float>();
    if (!tracer.Trace(view.cast<float>(), to.normalized(), 0).hit) {
      sky += static_cast<double>(gains[i]);
    }
  }
  return sky;
}

}  // namespace

OutdoorJobResult RunOutdoorJob(const simulation::Scene& scene, size_t most_scans,
                               parallel::Parallel& parallel) {
  sensor::ScannerModel scanner;
  scanner.range_max = kRangeMax;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(kStep);
  planning::PlanningConfig config;
  config.required_density = kDensity;
  const simulation::SimulatedScanner tracer(scene.mesh);
  std::vector<Eigen::Vector3d> positions;
  const simulation::WalkableGround ground(tracer, scene.mesh.Bounds(), scene.starts[0]);
  for (const double height : {1.2, 1.8}) {
    const std::vector<Eigen::Vector3d> level = ground.Stations(height, scanner.clearance, kLattice);
    positions.insert(positions.end(), level.begin(), level.end());
  }
  simulation::GroundTruth truth(scene.mesh, tracer, scanner, kDensity, positions, kTruthSamples,
                                parallel);
  auto model = model::PartialModel::Create({}).value();
  OutdoorJobResult result;
  Eigen::Vector3d position = scene.starts[0];
  while (true) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(position);
    pose.rotate(
        Eigen::AngleAxisd(0.7 * static_cast<double>(result.scans), Eigen::Vector3d::UnitZ()));
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, result.scans + 1, parallel);
    model->Insert(absl::StrCat("scan", result.scans), scan, pose, parallel).value();
    truth.AddScan(position, parallel);
    ++result.scans;
    result.attained = truth.Measure().attained_share();

    parallel::Budget budget;
    budget.work_limit = kWork;
    const auto view = model->Publish();
    const auto problem =
        planning::PlanningProblem::Prepare({*view, scanner, config}, parallel).value();
    const planning::Plan plan =
        planning::MakePlan(*problem, budget, parallel, [](const planning::Plan&) {});
    result.estimated = plan.coverage->estimated_coverage.value_or(0);
    result.stopped =
        plan.termination.suggested || plan.outcome == planning::PlanOutcome::kNothingToGain;
    const double sky =
        plan.views.empty() ? 0 : GainInSky(*problem, plan.views[0].position, tracer.tracer());
    const double gain = plan.views.empty() ? 0 : plan.views[0].model_gain.value_or(0);
    std::fprintf(stderr,
                 "%s: scan %zu, attained %.3f, estimated %.3f, gain %.1f m2, in sky %.1f%s\n",
                 scene.name.c_str(), result.scans, result.attained, result.estimated, gain, sky,
                 result.stopped       ? ", stop"
                 : plan.views.empty() ? plan.message.c_str()
                                      : "");
    if (result.stopped || plan.views.empty() || result.scans == most_scans) return result;
    result.promised += gain;
    result.promised_sky += sky;
    position = plan.views[0].position;
  }
}

}  // namespace vantage::bench
