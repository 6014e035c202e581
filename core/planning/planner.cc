#include "core/planning/planner.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/planning/budget_shares.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/evaluation/patch_order.h"
#include "core/planning/outcome.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/plan/stage_clock.h"
#include "core/planning/ranking/gain_bounds.h"
#include "core/planning/ranking/gain_search.h"
#include "core/planning/ranking/instrument_limit.h"
#include "core/planning/ranking/interim_plans.h"
#include "core/planning/ranking/narrow_ways.h"
#include "core/planning/ranking/open_doors.h"
#include "core/planning/ranking/optimality_gap.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/score_map.h"
#include "core/planning/ranking/target_advice.h"
#include "core/planning/ranking/termination.h"
#include "core/planning/ranking/view_report.h"

namespace vantage::planning {
namespace {

void NoteNarrowWays(const PlanningProblem& problem, const parallel::Budget& budget,
                    parallel::Parallel& parallel, Plan& plan) {
  plan.narrow_ways = FindNarrowWays({problem, problem.scoring().cells(),
                                     plan.termination.best_gain_without_hidden.value_or(0)},
                                    plan.rays, budget.Concluding(), parallel)
                         .ways;
}

// True when nothing is deficient or nowhere can be stood: that is the plan, then.
bool NothingToEvaluate(const PlanningProblem& problem, const parallel::Budget& budget,
                       parallel::Parallel& parallel, Plan& plan) {
  const bool deficient = !problem.patches().cells.empty();
  if (deficient && !problem.feasible().cells().empty()) return false;
  Termination termination =
      JudgeTermination(problem.patches(), {}, problem.config(), std::nullopt, std::nullopt);
  Outcome outcome = deficient
                        ? NowhereToStand(problem.feasible(), problem.scanner(), problem.config())
                        : NothingDeficient(termination);
  EndCertain(std::move(outcome), std::move(termination), plan);
  if (deficient) NoteNarrowWays(problem, budget, parallel, plan);
  return true;
}

Evaluation Evaluate(const PlanningProblem& problem, const parallel::Budget& budget,
                    parallel::Parallel& parallel, EvaluationProgress progress,
                    absl::FunctionRef<uint64_t(const Evaluation&)> after_first_look) {
  const PlanningConfig& config = problem.config();
  const Scoring& scoring = problem.scoring();
  if (config.order == EvaluationOrder::kPatches) {
    // The paper's epsilon is used only with the paper's order; all else is scored exactly.
    HierarchyOptions options;
    options.tolerance = config.density_tolerance;
    return EvaluateByPatches(scoring.scorer(), problem.feasible(), scoring.cells(),
                             problem.patches(), problem.grid(), options, budget, parallel,
                             progress);
  }
  AnytimeOptions options;
  options.confidence = config.confidence;
  options.seed = config.seed;
  options.separation = config.candidate_separation;
  options.leaders = config.candidates;
  options.after_first_look.emplace(after_first_look);
  return EvaluateViews(scoring.scorer(), problem.feasible(), scoring.cells(), problem.grid(),
                       options, budget, parallel, progress);
}

// Of some views where the budget ended before one was scored: preparing has no deadline, and a plan
// without an answer helps nobody.
Evaluation EvaluateAtLeast(const PlanningProblem& problem, const parallel::Budget& budget,
                           parallel::Parallel& parallel, EvaluationProgress progress,
                           absl::FunctionRef<uint64_t(const Evaluation&)> after_first_look) {
  Evaluation evaluation = Evaluate(problem, budget, parallel, progress, after_first_look);
  if (evaluation.any() || budget.cancelled.stop_requested()) return evaluation;
  return Evaluate(problem, LeastEvaluation(budget), parallel, progress,
                  [](const Evaluation&) { return uint64_t{0}; });
}

void NoteEvaluation(const PlanningProblem& problem, const Evaluation& evaluation, Plan& plan) {
  plan.rays = evaluation.rays;
  plan.complete = evaluation.complete;
  if (evaluation.complete) plan.confidence = 1;
  plan.score_map = ScoreMap(evaluation, problem.feasible());
}

// Views were ranked by their estimates and have exact scores now. All register and lie apart, so
// they are sorted by score.
void SortByExactScore(std::vector<RankedView>& views) {
  if (!std::all_of(views.begin(), views.end(), [](const RankedView& v) { return v.exact; })) return;
  std::stable_sort(views.begin(), views.end(),
                   [](const RankedView& a, const RankedView& b) { return a.score > b.score; });
}

// Whether to stop, by what the described views gain and what others may.
Termination Terminate(const PlanningProblem& problem, const Evaluation& evaluation,
                      const parallel::Budget& budget, parallel::Parallel& parallel,
                      GainSearch& search, Plan& plan) {
  search.Know(
      std::max(LargestGainWithoutHidden(plan.views), LargestGainWithoutHidden(plan.refused)),
      std::max(LargestModelGain(plan.views), LargestModelGain(plan.refused)));
  plan.rays += search.Seek(evaluation, plan.rays, budget.Concluding(), parallel);
  return JudgeTermination(problem.patches(), evaluation, problem.config(),
                          UnobservableArea(problem.patches(), evaluation),
                          search.Bounds(evaluation));
}

void DescribeChecked(const RegistrationCheck& check, const ViewReport& report,
                     const Evaluation& evaluation, size_t wanted, const parallel::Budget& budget,
                     parallel::Parallel& parallel, Plan& plan) {
  const parallel::Budget concluding = budget.Concluding();
  plan.views = report.Describe(check.registrable, evaluation, wanted, concluding, parallel);
  SortByExactScore(plan.views);
  // People go to the first view, and what it brings is what they ask: as with its verdict, the
  // budget is overrun for that.
  if (!plan.views.empty() && !plan.views.front().model_gain.has_value()) {
    report.DescribeGain(Overrun(concluding), parallel, plan.views.front());
  }
  ViewReport::NameFallback(plan.views);
  plan.refused = report.Describe(check.refused, evaluation, wanted, concluding, parallel);
}

// What was used so far, and the time to check as many candidates again as may be, s.
std::optional<double> BudgetThatWouldDo(const RegistrationCheck& check, const Plan& plan,
                                        const PlanningConfig& config,
                                        const parallel::Budget& budget) {
  if (budget.deadline == parallel::Budget::Clock::time_point::max() || check.checked == 0) {
    return std::nullopt;
  }
  const double checking = plan.seconds[static_cast<size_t>(PlanStage::kCheck)];
  return std::accumulate(plan.seconds.begin(), plan.seconds.end(), 0.0) +
         config.max_checked * checking / static_cast<double>(check.checked);
}

Outcome OutcomeOf(const RegistrationCheck& check, const Evaluation& evaluation, bool any_candidate,
                  const Plan& plan, const PlanningConfig& config, const parallel::Budget& budget) {
  if (budget.cancelled.stop_requested()) return CancelledAfter(check.checked);
  if (!check.registrable.empty()) {
    return ViewsFound(
        check.registrable.size(), check.refused.size(),
        absl::StrCat(evaluation.exact, " of ", evaluation.views.size(), " views scored exactly"));
  }
  if (!any_candidate) return NothingGains(evaluation.complete);
  if (plan.attainable_accuracy.has_value()) {
    return NoneCanRegister(check.checked, *plan.attainable_accuracy, config.registration);
  }
  if (check.finished) return NoneRegisters(check.checked, check.refused.front().verdict);
  return UnfinishedAfter(check.checked, check.refused.empty() ? nullptr : &check.refused[0].verdict,
                         BudgetThatWouldDo(check, plan, config, budget), budget);
}

}  // namespace

absl::StatusOr<Plan> MakePlan(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                              const PlanningConfig& config, const parallel::Budget& budget,
                              parallel::Parallel& parallel, PlanProgress progress) {
  const auto problem = PlanningProblem::Prepare({model, scanner, config}, parallel,
                                                parallel::Cancellation(budget.cancelled));
  if (problem.ok()) return MakePlan(**problem, budget, parallel, progress);
  if (!absl::IsCancelled(problem.status())) return problem.status();
  return EndedPreparing(problem.status().message(), model, config, budget);
}

Plan MakePlan(const PlanningProblem& problem, const parallel::Budget& budget,
              parallel::Parallel& parallel, PlanProgress progress) {
  const PlanningConfig& config = problem.config();
  const auto wanted = static_cast<size_t>(config.candidates);

  // A to C. Feasible views and ranked patches, as the problem has them.
  Plan plan = BeginPlan(problem);
  StageClock clock(plan.seconds);
  // A narrow way is all there is to say where no view is found, so that the budget is overrun.
  const parallel::Budget longest = Overrun(budget);
  if (NothingToEvaluate(problem, longest, parallel, plan)) return plan;

  // D. Evaluate views.
  const ViewReport report(problem, parallel);
  const parallel::Budget evaluating =
      EvaluationShare(budget, AnswerSeconds(problem, parallel.width()));
  KnownVerdicts known;
  InterimPlans interim(problem, report, plan, evaluating, parallel, known);
  GainSearch search(problem, problem.scoring().cells(), report.gains(),
                    report.most_gain_per_sample());
  const Evaluation evaluation = EvaluateAtLeast(
      problem, evaluating, parallel,
      [&](const Evaluation& so_far) { progress(StillEvaluating(interim.Of(so_far))); },
      [&](const Evaluation& so_far) {
        return search.Seek(so_far, so_far.rays, StopShare(evaluating, so_far.rays), parallel);
      });
  NoteEvaluation(problem, evaluation, plan);
  clock.Book(PlanStage::kEvaluate);
  if (!evaluation.any()) {
    EndWithoutEvaluation(EndedDuring("evaluate views", budget), plan);
    return plan;
  }

  // E. Rank views.
  const std::vector<uint32_t> ranked =
      RankViews(evaluation, problem.feasible(), config.candidate_separation,
                static_cast<size_t>(config.max_checked));
  clock.Book(PlanStage::kRankViews);

  // F. Check registration.
  const parallel::Budget share = CheckShare(budget, plan.rays);
  const RegistrationCheck check = CheckUntilOneRegisters(problem, evaluation, ranked, wanted, share,
                                                         Overrun(share), parallel, known);
  plan.rays += check.rays;
  const InstrumentLimit limit = FindInstrumentLimit(problem, check, budget.Concluding());
  plan.attainable_accuracy = limit.attainable;
  plan.rays += limit.rays;
  clock.Book(PlanStage::kCheck);

  DescribeChecked(check, report, evaluation, wanted, budget, parallel, plan);
  plan.optimality_gap = OptimalityGap(problem, evaluation, check, plan.views);
  plan.termination = Terminate(problem, evaluation, budget, parallel, search, plan);
  NoteNarrowWays(problem, plan.views.empty() ? longest : budget, parallel, plan);
  plan.rays += AdviseTargets(problem, budget.Concluding(), plan);
  plan.rays += NoteOpenDoors(problem, budget.Concluding(), plan);
  Conclude(OutcomeOf(check, evaluation, !ranked.empty(), plan, config, budget), plan);
  clock.Book(PlanStage::kRankViews);
  return plan;
}

}  // namespace vantage::planning
