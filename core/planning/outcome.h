// How plans end, and in what words: all texts of outcomes are here.
#ifndef VANTAGE_CORE_PLANNING_OUTCOME_H_
#define VANTAGE_CORE_PLANNING_OUTCOME_H_

#include <cstddef>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

struct Outcome {
  PlanOutcome kind = PlanOutcome::kSearchUnfinished;
  std::string message;
};

// Nothing is deficient; `termination` says so.
Outcome NothingDeficient(const Termination& termination);
// No view is feasible: which constraint leaves none, and what to do about it.
Outcome NowhereToStand(const FeasibleViews& none, const sensor::ScannerModel& scanner,
                       const PlanningConfig& config);
// Views are feasible, and none of several scanners can be sent to any; `why` not the first one.
Outcome NowhereToGo(std::string why);
// The budget ended before a view was evaluated, in `step` (one of kPlanStageNames).
Outcome EndedDuring(absl::string_view step, const parallel::Budget& budget);
// The same after some views were checked.
Outcome CancelledAfter(size_t checked);
// `best`: of the best view that was refused. `would_do`: a budget that would probably do, s; absent
// where time was not the limit.
Outcome UnfinishedAfter(size_t checked, const registration::RegistrationVerdict* best,
                        std::optional<double> would_do, const parallel::Budget& budget);
// All views that were checked are refused; `first` is the verdict on the best.
Outcome NoneRegisters(size_t checked, const registration::RegistrationVerdict& first);
// The same where the required accuracy cannot be met with the scanner: `attainable` (m) can.
Outcome NoneCanRegister(size_t checked, double attainable,
                        const registration::RegistrationConfig& config);
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
// Views that register were found, each with one of so many settings.
Outcome ViewsBySetting(size_t views, size_t settings);

// The outcome of a plan that came to its end.
void Conclude(Outcome outcome, Plan& plan);
// An interim plan as it is shown: the first of its views is checked for registration, or none.
Plan StillEvaluating(Plan interim);
// What is added where no way is known from the scanner to `without` of so many viewcells.
void AddNoWayTo(size_t without, size_t viewcells, Plan& plan);
// What is added where so many claimed views and stations count as scanned, and what scores more
// than twice as much as the plan's first view does not register.
void AddScansNotIn(size_t awaited, Plan& plan);
// The outcome of a plan that has nothing to say of when to stop.
void EndWithoutEvaluation(Outcome outcome, Plan& plan);
// The plan of a problem that was not prepared: the budget ended in `step` of
// PlanningProblem::Prepare().
Plan EndedPreparing(absl::string_view step, const model::PlanningView& model,
                    const PlanningConfig& config, const parallel::Budget& budget);
// The outcome of a plan of which it is certain that there is nothing to evaluate.
void EndCertain(Outcome outcome, Termination termination, Plan& plan);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OUTCOME_H_
