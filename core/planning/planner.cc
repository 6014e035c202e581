#include "core/planning/planner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/end_early.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/evaluation/patch_order.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/patches/measure_coverage.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/plan/stage_clock.h"
#include "core/planning/planning_estimate.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/termination.h"
#include "core/planning/ranking/view_report.h"
#include "core/planning/scoring/scoring.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {
namespace {

using Clock = parallel::Budget::Clock;

// What step D may use: the rest is kept for ranking and the registration check.
parallel::Budget EvaluationShare(const parallel::Budget& budget) {
  constexpr double kShare = 0.8;
  constexpr auto kMostReserved = std::chrono::milliseconds(400);
  parallel::Budget share = budget.Evaluating();
  if (budget.deadline != Clock::time_point::max()) {
    const auto left = std::max(budget.deadline - budget.now(), Clock::duration::zero());
    const auto reserved = std::chrono::duration_cast<Clock::duration>((1 - kShare) * left);
    share.deadline = budget.deadline - std::min<Clock::duration>(reserved, kMostReserved);
  }
  if (budget.work_limit != std::numeric_limits<uint64_t>::max()) {
    share.work_limit = static_cast<uint64_t>(kShare * static_cast<double>(budget.work_limit));
  }
  return share;
}

// The paper's epsilon belongs to its order. Everything else scores to the end.
HierarchyOptions PaperOptions(const PlanningConfig& config) {
  HierarchyOptions options;
  options.tolerance = config.density_tolerance;
  return options;
}

// Section 8: how much better than the returned view another could still be, of those that are
// neither refused nor too near to a refused one.
double OptimalityGap(const Evaluation& evaluation, const FeasibleViews& feasible,
                     const RegistrationCheck& check, double separation,
                     const std::vector<RankedView>& returned) {
  double most = 0;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    if (evaluation.views[i].upper <= most) continue;
    const bool refused =
        std::any_of(
            check.refused.begin(), check.refused.end(),
            [&](const CheckedView& other) {
              return i == other.view ||
                     (!other.alone &&
                      (feasible.Centre(i) - feasible.Centre(other.view)).norm() < separation);
            }) ||
        std::find(check.refused_around.begin(), check.refused_around.end(), i) !=
            check.refused_around.end();
    if (!refused) most = evaluation.views[i].upper;
  }
  if (most <= 0) return 0;
  if (returned.empty()) return 1;
  return std::clamp(1 - returned.front().lower / most, 0.0, 1.0);
}

// Described views were ranked by what samples said of them. All register and lie apart, so that the
// best is the one that scores best.
void SortByExactScore(std::vector<RankedView>& views) {
  if (!std::all_of(views.begin(), views.end(), [](const RankedView& v) { return v.exact; })) return;
  std::stable_sort(views.begin(), views.end(),
                   [](const RankedView& a, const RankedView& b) { return a.score > b.score; });
}

// Deficient surface that no view gains anything on; known when every view was scored on every cell.
std::optional<double> UnobservableArea(const PatchSet& patches, const Evaluation& evaluation) {
  if (!evaluation.complete) return std::nullopt;
  double area = 0;
  for (size_t i = 0; i < patches.cells.size(); ++i) {
    const bool seen = i < evaluation.seen.size() && evaluation.seen[i] != 0;
    if (!seen) area += static_cast<double>(patches.cells[i].area);
  }
  return area;
}

std::vector<ScoredCell> ScoreMap(const Evaluation& evaluation, const FeasibleViews& feasible) {
  std::vector<ScoredCell> map;
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    const ViewEstimate& view = evaluation.views[i];
    if (!view.scored) continue;
    map.push_back({feasible.Centre(i).cast<float>(), static_cast<float>(view.score),
                   static_cast<float>(view.lower), static_cast<float>(view.upper)});
  }
  return map;
}

void SetOutcome(const RegistrationCheck& check, const Evaluation& evaluation, bool any_candidate,
                const parallel::Budget& budget, Plan& plan) {
  if (budget.cancelled.stop_requested()) {
    plan.outcome = PlanOutcome::kCancelled;
    plan.message = absl::StrCat("cancelled after ", check.checked, " views were checked");
  } else if (!check.registrable.empty()) {
    plan.outcome = PlanOutcome::kViews;
    plan.message = absl::StrFormat(
        "%d views register, %d were refused, %d of %d views scored exactly",
        static_cast<int>(check.registrable.size()), static_cast<int>(check.refused.size()),
        static_cast<int>(evaluation.exact), static_cast<int>(evaluation.views.size()));
  } else if (!any_candidate) {
    plan.outcome =
        evaluation.complete ? PlanOutcome::kNothingToGain : PlanOutcome::kSearchUnfinished;
    plan.message = evaluation.complete ? "no feasible view gains anything"
                                       : "no view that gains anything was found in the time";
  } else if (check.finished) {
    plan.outcome = PlanOutcome::kNoRegistrableView;
    plan.message = absl::StrCat(
        "none of the ", check.checked,
        " best views can be registered; the first: ", check.refused.front().verdict.reason,
        "; remedy: ", check.refused.front().verdict.remedy);
  } else {
    plan.outcome = PlanOutcome::kSearchUnfinished;
    plan.message = absl::StrCat(budget.WhyEnded(), " after ", check.checked,
                                " views were checked for registration and none passed");
  }
}

}  // namespace

absl::StatusOr<Plan> MakePlan(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                              const PlanningConfig& config, const parallel::Budget& budget,
                              parallel::Parallel& parallel, PlanProgress progress) {
  if (absl::Status valid = ValidateFor(model, scanner, config); !valid.ok()) return valid;
  if (absl::Status fits = CheckPlanningSize(model, config); !fits.ok()) return fits;
  Plan plan;
  plan.model_version = model.version();
  plan.seed = config.seed;
  plan.required_density = config.required_density;
  plan.confidence = config.confidence;
  StageClock clock(plan);

  // A. Feasible views.
  const visibility::OpaqueGrid grid(model, {0, 1, 2}, budget);
  if (budget.Expired()) return EndEarly(plan, budget, "feasible views");
  const FeasibleViews feasible =
      FeasibleViews::Find(model, grid, scanner, config, budget, parallel);
  plan.feasible_cells = feasible.cells().size();
  clock.Book(PlanStage::kFeasible);
  if (!feasible.finished()) return EndEarly(plan, budget, "feasible views");

  // B. Extract patches.
  PatchSet patches = ExtractPatches(model, config, PatchTolerance{}, budget);
  plan.coverage = MeasureCoverageWithin(model, config, budget);
  plan.deficient_cells = patches.cells.size();
  plan.deficient_area = patches.area;
  clock.Book(PlanStage::kPatches);
  if (!patches.finished) return EndEarly(plan, budget, "extract patches");

  // C. Rank patches.
  RankPatches(config, patches, budget);
  if (!patches.finished) return EndEarly(plan, budget, "rank patches");
  plan.patches = patches.patches;
  clock.Book(PlanStage::kRankPatches);

  if (patches.cells.empty() || feasible.cells().empty()) {
    plan.outcome =
        patches.cells.empty() ? PlanOutcome::kNothingToGain : PlanOutcome::kNoFeasibleView;
    plan.termination = JudgeTermination(patches, {}, config, std::nullopt);
    plan.message =
        patches.cells.empty() ? plan.termination.reason : feasible.Explain(scanner, config);
    plan.complete = true;
    plan.optimality_gap = 0;
    return plan;
  }

  // D. Evaluate views.
  if (budget.Expired()) return EndEarly(plan, budget, "rank patches");
  const Scoring scoring(model, grid, patches, scanner, config, parallel, budget);
  if (!scoring.finished()) return EndEarly(plan, budget, "evaluate views");
  AnytimeOptions options;
  options.confidence = config.confidence;
  options.seed = config.seed;
  options.separation = config.candidate_separation;
  options.leaders = config.candidates;
  const ViewReport report(model, grid, feasible, patches, scoring);
  const auto show = [&](const Evaluation& so_far) {
    progress(report.Interim(plan, so_far, config));
  };
  const parallel::Budget share = EvaluationShare(budget);
  const Evaluation evaluation =
      config.order == EvaluationOrder::kPatches
          ? EvaluateByPatches(scoring.scorer(), feasible, scoring.cells(), patches, grid,
                              PaperOptions(config), share, parallel, show)
          : EvaluateViews(scoring.scorer(), feasible, scoring.cells(), options, share, parallel,
                          show, &grid);
  plan.rays = evaluation.rays;
  plan.complete = evaluation.complete;
  if (evaluation.complete) plan.confidence = 1;
  plan.score_map = ScoreMap(evaluation, feasible);
  clock.Book(PlanStage::kEvaluate);
  if (!evaluation.any()) return EndEarly(plan, budget, "evaluate views");

  // E. Rank views.
  const std::vector<uint32_t> ranked = RankViews(evaluation, feasible, config.candidate_separation,
                                                 static_cast<size_t>(config.max_checked));
  clock.Book(PlanStage::kRankViews);

  // F. Registration check.
  parallel::Budget rest = budget.Concluding();
  if (rest.work_limit != std::numeric_limits<uint64_t>::max()) {
    // A ranking of which nothing was checked is worth little: the check keeps its part even where
    // the evaluation's last batch overran its own.
    const uint64_t left = rest.work_limit - std::min(rest.work_limit, plan.rays);
    rest.work_limit = std::max(left, rest.work_limit / 10);
  }
  if (rest.deadline != Clock::time_point::max()) {  // the answers have to be written up as well
    rest.deadline -= std::max(rest.deadline - rest.now(), Clock::duration::zero()) / 3;
  }
  const OverlapSurface overlap(model, grid, scoring.scene(), scanner, rest);
  const RegistrationCheck check =
      CheckRegistration(overlap, scoring.scene(), evaluation, feasible, ranked,
                        static_cast<size_t>(config.candidates), config, rest, parallel);
  plan.rays += check.rays;
  clock.Book(PlanStage::kCheck);

  plan.termination =
      JudgeTermination(patches, evaluation, config, UnobservableArea(patches, evaluation));
  plan.views =
      report.Describe(check.registrable, evaluation, static_cast<size_t>(config.candidates),
                      budget.Concluding(), parallel);
  SortByExactScore(plan.views);
  plan.optimality_gap =
      OptimalityGap(evaluation, feasible, check, config.candidate_separation, plan.views);
  plan.refused = report.Describe(check.refused, evaluation, static_cast<size_t>(config.candidates),
                                 budget.Concluding(), parallel);
  SetOutcome(check, evaluation, !ranked.empty(), budget, plan);
  clock.Book(PlanStage::kRankViews);
  return plan;
}

}  // namespace vantage::planning
