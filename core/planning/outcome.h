// How plans end, and in what words: all texts of outcomes are here.
#ifndef VANTAGE_CORE_PLANNING_OUTCOME_H_
#define VANTAGE_CORE_PLANNING_OUTCOME_H_

#include <cstddef>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "core/parallel/budget.h"
#include "core/planning/plan/plan.h"
#include "core/registration/bound/verdict.h"

namespace vantage::planning {

struct Outcome {
  PlanOutcome kind = PlanOutcome::kSearchUnfinished;
  std::string message;
};

// The budget ended before a view was evaluated, in `step` (one of kPlanStageNames).
Outcome EndedDuring(absl::string_view step, const parallel::Budget& budget);
// The same after some views were checked.
Outcome CancelledAfter(size_t checked);
Outcome UnfinishedAfter(size_t checked, const parallel::Budget& budget);
// All views that were checked are refused; `first` is the verdict on the best.
Outcome NoneRegisters(size_t checked, const registration::RegistrationVerdict& first);
// No candidate gains anything. `complete`: every view was scored, so that this is certain.
// `beyond`: what it is added to ('beyond the claimed ones'), or empty.
Outcome NothingGains(bool complete, absl::string_view beyond = {});
// What is left to gain lies too near to views that are claimed.
Outcome CrowdedOut();
// Views that register were found for one scanner. `evaluated`: how exactly, or empty.
Outcome ViewsFound(size_t views, size_t refused, absl::string_view evaluated = {});
// Views were found for some of several scanners; `gain` is the model gain of all views together,
// m^2; absent when it is not known.
Outcome ViewsFoundForFleet(size_t views, size_t scanners, std::optional<double> gain,
                           size_t refused);

// The outcome of a plan that came to its end.
void Conclude(Outcome outcome, Plan& plan);
// The outcome of a plan that has nothing to say of when to stop.
void EndWithoutEvaluation(Outcome outcome, Plan& plan);
// The outcome of a plan of which it is certain that there is nothing to evaluate.
void EndCertain(Outcome outcome, Termination termination, Plan& plan);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OUTCOME_H_
