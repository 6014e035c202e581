#include "tests/bench/outdoor_job.h"

#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
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

// Where a crew goes that carries targets: to the first view, or to one that was refused and
// registers with the targets that the plan advises, where that brings much more. Null where neither
// is.
struct Choice {
  const planning::RankedView* view = nullptr;
  bool with_targets = false;
  double gain = 0;  // m^2
};
Choice NextView(const planning::Plan& plan) {
  constexpr double kWorthTargets = 2;  // times the gain of the best view without
  Choice choice;
  if (!plan.views.empty()) {
    choice = {&plan.views[0], false, plan.views[0].model_gain.value_or(0)};
  }
  double most = kWorthTargets * choice.gain;
  for (const planning::RankedView& view : plan.refused) {
    if (!view.targets.has_value() || view.model_gain.value_or(0) <= most) continue;
    most = *view.model_gain;
    // Where another scan has to see the targets first, that is the next.
    const std::optional<size_t> first = view.targets->first_view;
    choice = first.has_value()
                 ? Choice{&plan.views[*first], false, plan.views[*first].model_gain.value_or(0)}
                 : Choice{&view, true, most};
  }
  return choice;
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
    const Choice next = NextView(plan);
    const double sky =
        next.view == nullptr ? 0 : GainInSky(*problem, next.view->position, tracer.tracer());
    std::fprintf(stderr,
                 "%s: scan %zu, attained %.3f, estimated %.3f, gain %.1f m2, in sky %.1f%s%s\n",
                 scene.name.c_str(), result.scans, result.attained, result.estimated, next.gain,
                 sky, next.with_targets ? ", with targets" : "",
                 result.stopped         ? ", stop"
                 : next.view == nullptr ? plan.message.c_str()
                                        : "");
    if (result.stopped || next.view == nullptr || result.scans == most_scans) return result;
    result.promised += next.gain;
    result.promised_sky += sky;
    result.with_targets += next.with_targets ? 1 : 0;
    position = next.view->position;
  }
}

}  // namespace vantage::bench
