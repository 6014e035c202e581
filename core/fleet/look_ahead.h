// Looks at the scan after the next one (algorithm.md section 11).
#ifndef VANTAGE_CORE_FLEET_LOOK_AHEAD_H_
#define VANTAGE_CORE_FLEET_LOOK_AHEAD_H_

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/plan.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::fleet {

// Where a view was refused that would gain more than all that register, puts that of the plan's
// views first which is worth most together with its follower: with the refused one, if that
// registers after it, or with another of the plan's views. What follows counts by the
// chances that its place is free and that it registers. A view at the door is so chosen for the
// sake of one inside, and says so (RankedView::enables). Bounds and verdicts stay; the views behind
// the first keep their order. Nothing changes when the budget ends on the way. Adds to the plan's
// rays.
void LookAhead(const planning::PlanningProblem& problem, const parallel::Budget& budget,
               parallel::Parallel& parallel, planning::Plan& plan);

// planning::MakePlan(), which leaves a tenth of the time for LookAhead().
planning::Plan MakePlanLookingAhead(const planning::PlanningProblem& problem,
                                    const parallel::Budget& budget, parallel::Parallel& parallel,
                                    planning::PlanProgress progress);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_LOOK_AHEAD_H_
