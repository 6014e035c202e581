// Where targets would make a view register that was refused (algorithm.md section 9, 'Advice on
// targets').
#ifndef VANTAGE_CORE_PLANNING_RANKING_TARGET_ADVICE_H_
#define VANTAGE_CORE_PLANNING_RANKING_TARGET_ADVICE_H_

#include <cstdint>
#include <optional>

#include "core/parallel/budget.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/plan/target_advice.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::planning {

// Sets RankedView::targets of the best refused views, as far as the budget goes; where no view
// registers, of the best one whatever time is left. Returns the rays that it took.
uint64_t AdviseTargets(const PlanningProblem& problem, const parallel::Budget& budget, Plan& plan);

// The smallest set of targets that was found with which a scan from `view`, whose verdict is set,
// is predicted to register: of PlanningConfig::targets; or else such that all of them are seen from
// one more place, where they are measured: `next`, a view that registers, or a station. Nothing
// where there is none, where targets are not what is wanting (too little overlap), or where the
// budget ended.
std::optional<TargetAdvice> FindTargets(const PlanningProblem& problem, const RankedView& view,
                                        const RankedView* next, const parallel::Budget& budget,
                                        uint64_t& rays);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_TARGET_ADVICE_H_
