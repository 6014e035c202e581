#include "core/planning/outcome.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::planning {

Outcome EndedDuring(absl::string_view step, const parallel::Budget& budget) {
  return {
      budget.cancelled.stop_requested() ? PlanOutcome::kCancelled : PlanOutcome::kSearchUnfinished,
      absl::StrCat(budget.WhyEnded(), " during '", step, "', before any view was evaluated")};
}

Outcome CancelledAfter(size_t checked) {
  return {PlanOutcome::kCancelled,
          absl::StrCat("cancelled after ", checked, " views were checked")};
}

Outcome UnfinishedAfter(size_t checked, const parallel::Budget& budget) {
  return {PlanOutcome::kSearchUnfinished,
          absl::StrCat(budget.WhyEnded(), " after ", checked,
                       " views were checked for registration and none passed")};
}

Outcome NoneRegisters(size_t checked, const registration::RegistrationVerdict& first) {
  return {PlanOutcome::kNoRegistrableView,
          absl::StrCat("none of the ", checked, " best views can be registered; the first: ",
                       first.reason, "; remedy: ", first.remedy)};
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

void Conclude(Outcome outcome, Plan& plan) {
  plan.outcome = outcome.kind;
  plan.message = std::move(outcome.message);
}

void EndWithoutEvaluation(Outcome outcome, Plan& plan) {
  Conclude(std::move(outcome), plan);
  plan.termination.reason = "not known: no view was evaluated";
}

void EndCertain(Outcome outcome, Termination termination, Plan& plan) {
  Conclude(std::move(outcome), plan);
  plan.termination = std::move(termination);
  plan.complete = true;
  plan.optimality_gap = 0;
}

}  // namespace vantage::planning
