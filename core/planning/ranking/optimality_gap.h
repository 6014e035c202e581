// What is still possible beyond the views that are returned (algorithm.md section 8).
#ifndef VANTAGE_CORE_PLANNING_RANKING_OPTIMALITY_GAP_H_
#define VANTAGE_CORE_PLANNING_RANKING_OPTIMALITY_GAP_H_

#include <vector>

#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"

namespace vantage::planning {

// How much better than the best of `returned` another view could still be, of those that are
// neither refused nor too near to a refused one: a share in [0, 1], 1 where none was returned.
double OptimalityGap(const PlanningProblem& problem, const Evaluation& evaluation,
                     const RegistrationCheck& check, const std::vector<RankedView>& returned);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_OPTIMALITY_GAP_H_
