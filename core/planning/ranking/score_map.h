// The map of scores that a plan hands out.
#ifndef VANTAGE_CORE_PLANNING_RANKING_SCORE_MAP_H_
#define VANTAGE_CORE_PLANNING_RANKING_SCORE_MAP_H_

#include <vector>

#include "core/planning/evaluation/evaluation.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/plan/plan.h"

namespace vantage::planning {

// Every feasible viewcell that was scored, in their order.
std::vector<ScoredCell> ScoreMap(const Evaluation& evaluation, const FeasibleViews& feasible);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_SCORE_MAP_H_
