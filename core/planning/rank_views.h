// Step E: the views in order, and what a person needs to know of each (algorithm.md sections 6 and
// 11).
#ifndef VANTAGE_CORE_PLANNING_RANK_VIEWS_H_
#define VANTAGE_CORE_PLANNING_RANK_VIEWS_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/model/planning_view.h"
#include "core/parallel/budget.h"
#include "core/planning/anytime.h"
#include "core/planning/feasible_views.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"

namespace vantage {

// Scored views by score, equal ones by position, each at least `separation` from those before it;
// at most `count`, and none that gains nothing.
std::vector<uint32_t> RankViews(const Evaluation& evaluation, const FeasibleViews& feasible,
                                double separation, size_t count);

// The face-connected cells around `view` that score at least 95 % of it.
GoodRegion RegionAsGood(const Evaluation& evaluation, const FeasibleViews& feasible, uint32_t view);

// Two distinct walls and the last stand, as a person with a tape would use them.
Findable Find(const PlanningView& model, const Eigen::Vector3d& position, double height);

// What the gain is made of: exact. `gains` is one per cell of `cells`. Sets gain_by_kind and
// patches (at most 5).
void SplitGain(const CellArrays& cells, std::span<const float> gains, const PatchSet& patches,
               RankedView& view);

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_RANK_VIEWS_H_
