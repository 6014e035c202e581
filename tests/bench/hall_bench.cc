// What a hall of 100 x 60 x 15 m costs, which is nearly all empty space: memory of the model after
// a scan, memory and time of a plan.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/carve/carve.h"
#include "core/model/partial_model.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_estimate.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/large_hall.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scenes.h"
#include "tests/support/resident_memory.h"

namespace vantage::bench {

namespace {

constexpr double kEnough = 0.005;  // regret, [0, 1]
constexpr double kReference = 60;  // s, of the plan that others are compared with
constexpr std::array kBudgets = {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 48.0};  // s

// The site's limit as it is by default, but for its height: ranges of 60 m are longer than that.
model::ModelConfig HallConfig() {
  model::ModelConfig config;
  config.max_half_extent.z() = 100;
  return config;
}

// Whatever it takes.
planning::PlanningConfig PlanConfig() {
  planning::PlanningConfig config;
  config.memory_limit = uint64_t{1} << 40;
  return config;
}

sensor::Scan HallScan(uint64_t seed, Eigen::Isometry3d& pose, parallel::Parallel& parallel) {
  const simulation::Scene scene = simulation::LargeHall(seed);
  const simulation::SimulatedScanner simulated(scene.mesh);
  sensor::Scan scan;
  scan.scanner.range_max = 130;
  pose = Eigen::Isometry3d::Identity();
  pose.translate(scene.starts.front());
  scan.image = simulated.Scan(scan.scanner, pose, simulation::ScanFaults{}, seed, parallel);
  return scan;
}

// The time of whole plans, A to F, until the first view loses no more than kEnough beside that of a
// plan of a minute.
void BenchPlanSeconds(const model::PlanningView& view, const sensor::ScannerModel& scanner,
                      parallel::Parallel& parallel, Figures& figures) {
  const auto nobody = [](const planning::Plan&) {};
  const auto problem =
      planning::PlanningProblem::Prepare({view, scanner, PlanConfig()}, parallel).value();
  // Of the first view, or of the best one that was refused where none registers.
  const auto score = [&](const planning::Plan& plan) {
    const std::vector<planning::RankedView>& shown = plan.views.empty() ? plan.refused : plan.views;
    if (shown.empty()) return 0.0;
    return problem->scoring()
        .scorer()
        .Score(shown[0].position, problem->scoring().cells(), parallel::Budget::Unlimited())
        .score;
  };
  const planning::Plan reference =
      planning::MakePlan(*problem, parallel::Budget::Seconds(kReference), parallel, nobody);
  const double best = score(reference);
  double seconds = kReference;
  std::string by_budget;
  for (const double budget : kBudgets) {
    planning::Plan plan;
    const double took = WallSeconds([&] {
      plan = planning::MakePlan(view, scanner, PlanConfig(), parallel::Budget::Seconds(budget),
                                parallel, nobody)
                 .value();
    });
    const double regret = best > 0 ? 1 - score(plan) / best : 1;
    absl::StrAppendFormat(&by_budget, "; %.2f s: %.1f %%", took, 100 * std::max(0.0, regret));
    if (regret > kEnough) continue;
    seconds = took;
    break;
  }
  std::string stages;
  for (size_t stage = 0; stage < planning::kPlanStages; ++stage) {
    absl::StrAppendFormat(&stages, ", %s %.2f s", planning::kPlanStageNames[stage],
                          problem->seconds()[stage]);
  }
  figures.Add({"plan.hall100.seconds", seconds, "s", "1",
               absl::StrFormat(
                   "one scene: whole plans until the first view loses at most %g %% beside that of "
                   "a plan of %g s (gap %.3f%s); %d viewcells x %d cells%s; preparing%s",
                   100 * kEnough, kReference, reference.optimality_gap,
                   best > 0 ? "" : ", which has no view: no figure", reference.feasible_cells,
                   reference.deficient_cells, by_budget, stages)});
}

void BenchPlanMemory(const model::PlanningView& view, const sensor::ScannerModel& scanner,
                     parallel::Parallel& parallel, Figures& figures) {
  std::shared_ptr<const planning::PlanningProblem> problem;
  planning::Plan plan;
  const double before = test_support::ResidentMegabytes();
  const double preparing = test_support::TransientMegabytes([&] {
    problem = planning::PlanningProblem::Prepare({view, scanner, PlanConfig()}, parallel).value();
  });
  const double kept = test_support::ResidentMegabytes() - before;
  const double evaluating = test_support::TransientMegabytes([&] {
    plan = planning::MakePlan(*problem, parallel::Budget::Seconds(20), parallel,
                              [](const planning::Plan&) {});
  });
  const double after = test_support::ResidentMegabytes() - before;
  figures.Add(
      {"plan.hall100.mb", std::max(kept + preparing, after + evaluating), "MB", "300",
       absl::StrFormat(
           "one scene: at its peak beside the model: the prepared problem %.0f MB, %.0f more while "
           "it was prepared, %.0f more while views were evaluated for 20 s, %.0f of the "
           "plan; %.0f estimated; %d viewcells x %d cells, %d patches",
           kept, preparing, evaluating, after - kept,
           static_cast<double>(planning::PlanningSize(view, PlanConfig())
                                   .Bytes(static_cast<double>(plan.feasible_cells))) /
               1e6,
           plan.feasible_cells, plan.deficient_cells, plan.patches.size())});
}

}  // namespace

void BenchHall(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("model.hall100.") && !figures.Wants("plan.hall100.")) return;
  Eigen::Isometry3d pose;
  const sensor::Scan scan = HallScan(SceneSeeds(options.use).front(), pose, parallel);
  double layer = 0;
  if (figures.Wants("model.hall100.")) {
    const double before = test_support::ResidentMegabytes();
    const auto carved = model::Carve(scan, pose, HallConfig(), parallel);
    layer = test_support::ResidentMegabytes() - before;
  }
  const double before = test_support::ResidentMegabytes();
  const auto model = model::PartialModel::Create(HallConfig()).value();
  model::MergeReport report;
  const double transient = test_support::TransientMegabytes(
      [&] { report = model->Insert("scan", scan, pose, parallel).value(); });
  const std::shared_ptr<const model::PlanningView> view = model->Publish();
  if (figures.Wants("model.hall100.")) {
    const double resident = test_support::ResidentMegabytes() - before;
    figures.Add(
        {"model.hall100.mb", resident, "MB", "150",
         absl::StrFormat(
             "one scene: after one scan, %.0f MB of it the scan's layer; %.0f more while it "
             "was merged; %d bricks, %d surface voxels, %.1f M empty ones",
             layer, transient, view->bricks().size(), view->SurfaceCount(),
             static_cast<double>(report.empty_voxels) / 1e6)});
    figures.Add({"model.hall100.seconds", report.carve_seconds + report.merge_seconds, "s", "",
                 absl::StrFormat("one scene: carving %.2f s, merging %.2f s", report.carve_seconds,
                                 report.merge_seconds)});
  }
  if (figures.Wants("plan.hall100.mb")) {
    BenchPlanMemory(*view, scan.scanner, parallel, figures);
  }
  if (figures.Wants("plan.hall100.seconds")) {
    BenchPlanSeconds(*view, scan.scanner, parallel, figures);
  }
}

}  // namespace vantage::bench
