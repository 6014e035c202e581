#include "core/planning/problem/planning_problem.h"

#include <optional>
#include <utility>

#include "absl/memory/memory.h"
#include "absl/status/status.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/planning/openings/openings.h"
#include "core/planning/plan/stage_clock.h"
#include "core/planning/problem/planning_estimate.h"

namespace vantage::planning {
namespace {

// Whoever cancelled hears of the step, not of the part of it.
absl::Status During(PlanStage stage, const absl::Status& status) {
  if (!absl::IsCancelled(status)) return status;
  return absl::CancelledError(kPlanStageNames[static_cast<size_t>(stage)]);
}

bool SameSurface(const PlanningConfig& a, const PlanningConfig& b) {
  const auto same_region = [](const std::optional<Region>& x, const std::optional<Region>& y) {
    if (!x.has_value() || !y.has_value()) return x.has_value() == y.has_value();
    return x->min() == y->min() && x->max() == y->max();
  };
  return a.required_density == b.required_density && a.unknown_depth == b.unknown_depth &&
         a.weights == b.weights && same_region(a.region_of_interest, b.region_of_interest);
}

}  // namespace

absl::StatusOr<std::shared_ptr<const PlanningProblem>> PlanningProblem::Prepare(
    const PlanningQuestion& question, parallel::Parallel& parallel,
    const parallel::Cancellation& cancelled) {
  const model::PlanningView& model = question.model;
  const PlanningConfig& config = question.config;
  if (absl::Status valid = ValidateFor(model, question.scanner, config); !valid.ok()) return valid;
  if (absl::Status fits = CheckPlanningSize(model, config); !fits.ok()) return fits;
  const bool same_model = question.previous != nullptr && &question.previous->model_ == &model;
  auto problem = absl::WrapUnique(new PlanningProblem(question));
  StageClock clock(problem->seconds_);

  // A. Feasible views.
  std::optional<visibility::OpaqueGrid> grid;
  if (same_model) {
    problem->occlusion_ = question.previous->occlusion_;
  } else {
    auto made = visibility::OpaqueGrid::Create(model, cancelled);
    if (!made.ok()) return During(PlanStage::kFeasible, made.status());
    grid = *std::move(made);
  }
  auto feasible = FeasibleViews::Find(model, same_model ? problem->grid() : *grid, question.scanner,
                                      config, parallel, cancelled);
  if (!feasible.ok()) return During(PlanStage::kFeasible, feasible.status());
  problem->feasible_ = *std::move(feasible);
  const bool same_floor = same_model && question.previous->config_.floor_z == config.floor_z;
  clock.Book(PlanStage::kFeasible);

  if (same_floor && SameSurface(question.previous->config_, config)) {
    problem->surface_ = question.previous->surface_;
  } else {
    // B. Extract patches.
    auto patches = ExtractPatches(model, config, {}, cancelled);
    if (!patches.ok()) return During(PlanStage::kPatches, patches.status());
    auto openings = same_floor ? question.previous->openings()
                               : FindOpenings(model, problem->feasible_.floor(), cancelled);
    if (!openings.ok()) return During(PlanStage::kPatches, openings.status());
    auto coverage = MeasureCoverage(model, config, *std::move(openings), cancelled);
    if (!coverage.ok()) return During(PlanStage::kPatches, coverage.status());
    clock.Book(PlanStage::kPatches);

    // C. Rank patches.
    auto ranked = RankPatches(config, *std::move(patches), cancelled);
    if (!ranked.ok()) return During(PlanStage::kRankPatches, ranked.status());
    problem->surface_ =
        std::make_shared<const Surface>(Surface{*std::move(ranked), *std::move(coverage)});
    clock.Book(PlanStage::kRankPatches);
  }

  // What D needs.
  if (!same_model) {
    auto scene = visibility::OcclusionScene::Create(model, *grid, parallel, cancelled);
    if (!scene.ok()) return During(PlanStage::kEvaluate, scene.status());
    problem->occlusion_ =
        std::make_shared<const Occlusion>(Occlusion{*std::move(grid), *std::move(scene)});
  }
  auto scoring =
      Scoring::Create(model.voxel_size(), problem->grid(), problem->scene(), problem->patches(),
                      problem->scanner_, config, parallel, cancelled);
  if (!scoring.ok()) return During(PlanStage::kEvaluate, scoring.status());
  problem->scoring_ = *std::move(scoring);
  clock.Book(PlanStage::kEvaluate);
  return std::shared_ptr<const PlanningProblem>(std::move(problem));
}

Plan BeginPlan(const PlanningProblem& problem) {
  Plan plan = BeginPlan(problem.model(), problem.config());
  plan.feasible_cells = problem.feasible().cells().size();
  plan.coverage = problem.coverage();
  plan.deficient_cells = problem.patches().cells.size();
  plan.deficient_area = problem.patches().area;
  plan.patches = problem.patches().patches;
  plan.seconds = problem.seconds();
  return plan;
}

}  // namespace vantage::planning
