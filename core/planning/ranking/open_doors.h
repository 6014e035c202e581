// Doors that have to stay open for a view to register (algorithm.md section 9, 'Doors that stay
// open').
#ifndef VANTAGE_CORE_PLANNING_RANKING_OPEN_DOORS_H_
#define VANTAGE_CORE_PLANNING_RANKING_OPEN_DOORS_H_

#include <cstdint>
#include <vector>

#include "core/parallel/budget.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::planning {

// Sets RankedView::doors of the first views, as far as the budget goes. Returns the rays that it
// took.
uint64_t NoteOpenDoors(const PlanningProblem& problem, const parallel::Budget& budget, Plan& plan);

// The doorways of which each, if it were shut, would leave a view, which is predicted to register,
// without what it registers by. The largest share first. Empty where there is none, or the budget
// ended.
std::vector<OpenDoor> FindOpenDoors(const PlanningProblem& problem, const RankedView& view,
                                    const parallel::Budget& budget, uint64_t& rays);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_OPEN_DOORS_H_
