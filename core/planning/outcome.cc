#include "core/planning/outcome.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/bound/instrument_limit.h"

namespace vantage::planning {

Outcome NothingDeficient(const Termination& termination) {
  return {PlanOutcome::kNothingToGain, termination.reason};
}

Outcome NowhereToStand(const FeasibleViews& none, const sensor::ScannerModel& scanner,
                       const PlanningConfig& config) {
  const FloorMap& floor = none.floor();
  if (!floor.found()) {
    return {PlanOutcome::kNoFeasibleView,
            "no viewcell is feasible: the model shows no floor (upward measured surface under free "
            "space); set floor_z, or scan so that the floor is seen"};
  }
  std::string message = "no viewcell is feasible; of the cells at an allowed height over the floor";
  size_t total = 0;
  const char* separator = ": ";
  for (int reason = static_cast<int>(Infeasibility::kAboveObject); reason < kInfeasibilities;
       ++reason) {
    const size_t count = none.counts()[static_cast<size_t>(reason)];
    total += count;
    if (count == 0) continue;
    absl::StrAppend(&message, separator, count, " - ",
                    InfeasibilityWords(static_cast<Infeasibility>(reason), scanner, config));
    separator = "; ";
  }
  if (total == 0) {
    message = absl::StrFormat(
        "no viewcell is feasible: none lies wholly between %.2f m and %.2f m over the floor, which "
        "is at %.2f to %.2f m; widen the height range (it must hold a viewcell of %.2f m)",
        config.min_viewpoint_height, config.max_viewpoint_height, floor.lowest(), floor.highest(),
        none.cell_size());
  }
  return {PlanOutcome::kNoFeasibleView, std::move(message)};
}

Outcome NowhereToGo(std::string why) { return {PlanOutcome::kNoFeasibleView, std::move(why)}; }

Outcome EndedDuring(absl::string_view step, const parallel::Budget& budget) {
  return {
      budget.cancelled.stop_requested() ? PlanOutcome::kCancelled : PlanOutcome::kSearchUnfinished,
      absl::StrCat(budget.WhyEnded(), " during '", step, "', before any view was evaluated")};
}

Outcome CancelledAfter(size_t checked) {
  return {PlanOutcome::kCancelled,
          absl::StrCat("cancelled after ", checked, " views were checked")};
}

Outcome UnfinishedAfter(size_t checked, const registration::RegistrationVerdict* best,
                        std::optional<double> would_do, const parallel::Budget& budget) {
  std::string message = absl::StrCat(budget.WhyEnded(), " after ", checked,
                                     " views were checked for registration and none passed");
  if (best != nullptr) {
    absl::StrAppend(&message, "; the best: ", best->reason, "; remedy: ", best->remedy);
  }
  if (would_do.has_value()) {
    absl::StrAppendFormat(&message, "; a budget of %.1f s would probably do", *would_do);
  }
  return {PlanOutcome::kSearchUnfinished, std::move(message)};
}

Outcome NoneRegisters(size_t checked, const registration::RegistrationVerdict& first) {
  return {PlanOutcome::kNoRegistrableView,
          absl::StrCat("none of the ", checked,
                       " views checked, from the best on, can be registered; the first: ",
                       first.reason, "; remedy: ", first.remedy)};
}

Outcome NoneCanRegister(size_t checked, double attainable,
                        const registration::RegistrationConfig& config) {
  return {PlanOutcome::kNoRegistrableView,
          absl::StrCat("none of the ", checked, " views checked can be registered: ",
                       registration::InstrumentLimitReason(attainable, config),
                       "; remedy: ", registration::InstrumentLimitRemedy(attainable))};
}

Outcome NothingGains(bool complete, absl::string_view beyond) {
  if (!complete) {
    return {PlanOutcome::kSearchUnfinished, "no view that gains anything was found in the time"};
  }
  return {PlanOutcome::kNothingToGain,
          absl::StrCat("no feasible view gains anything", beyond.empty() ? "" : " ", beyond)};
}

Outcome CrowdedOut() {
  return {PlanOutcome::kNothingToGain,
          "what is left to gain lies nearer than two clearances to claimed views"};
}

Outcome ViewsFound(size_t views, size_t refused, absl::string_view evaluated) {
  return {PlanOutcome::kViews, absl::StrCat(views, " views register, ", refused, " were refused",
                                            evaluated.empty() ? "" : ", ", evaluated)};
}

Outcome ViewsFoundForFleet(size_t views, size_t scanners, std::optional<double> gain,
                           size_t refused) {
  const std::string together =
      gain.has_value() ? absl::StrFormat(", %.2f m2 together", *gain) : std::string();
  return {PlanOutcome::kViews, absl::StrFormat("views for %d of %d scanners%s; %d refused", views,
                                               scanners, together, refused)};
}

Outcome ViewsBySetting(size_t views, size_t settings) {
  return {
      PlanOutcome::kViews,
      absl::StrCat(views, " views register, with the settings that gain most for each minute, of ",
                   settings)};
}

void Conclude(Outcome outcome, Plan& plan) {
  plan.outcome = outcome.kind;
  plan.message = std::move(outcome.message);
}

Plan StillEvaluating(Plan interim) {
  const bool first = !interim.views.empty() && interim.views.front().checked;
  Conclude({PlanOutcome::kViews,
            first ? "still evaluating: the first view registers, the others are not yet checked"
                  : "still evaluating: the views are not yet checked for registration"},
           interim);
  return interim;
}

void AddNoWayTo(size_t without, size_t viewcells, Plan& plan) {
  absl::StrAppend(&plan.message, "; no way is known from where it stands to ", without, " of ",
                  viewcells, " viewcells");
}

void AddScansNotIn(size_t awaited, Plan& plan) {
  if (awaited == 0 || plan.refused.empty()) return;
  double most = 0;
  for (const RankedView& refused : plan.refused) most = std::max(most, refused.score);
  const double best = plan.views.empty() ? 0 : plan.views.front().score;
  if (most <= 2 * best) return;
  const std::string whose =
      awaited == 1 ? "the scan of a claimed view or station is"
                   : absl::StrCat("the scans of ", awaited, " claimed views or stations are");
  absl::StrAppend(&plan.message, "; ", whose, " not in yet, and views that score ",
                  best > 0 ? absl::StrFormat("%.1f times as much", most / best) : "more",
                  " do not register without: bring their data first if you can");
}

void EndWithoutEvaluation(Outcome outcome, Plan& plan) {
  Conclude(std::move(outcome), plan);
  plan.termination.reason = "not known: no view was evaluated";
}

Plan EndedPreparing(absl::string_view step, const model::PlanningView& model,
                    const PlanningConfig& config, const parallel::Budget& budget) {
  Plan plan = BeginPlan(model, config);
  EndWithoutEvaluation(EndedDuring(step, budget), plan);
  return plan;
}

void EndCertain(Outcome outcome, Termination termination, Plan& plan) {
  Conclude(std::move(outcome), plan);
  plan.termination = std::move(termination);
  plan.complete = true;
  plan.optimality_gap = 0;
}

}  // namespace vantage::planning
