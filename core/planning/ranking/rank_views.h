// Step E: the views in order, and what a person needs to know of each (algorithm.md sections 6 and
// 11).
#ifndef VANTAGE_CORE_PLANNING_RANKING_RANK_VIEWS_H_
#define VANTAGE_CORE_PLANNING_RANKING_RANK_VIEWS_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/ranked_view.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// Scored views by score, equal ones by position, each at least `separation` from those before it;
// at most `count`, and none that gains nothing.
std::vector<uint32_t> RankViews(const Evaluation& evaluation, const FeasibleViews& feasible,
                                double separation, size_t count);

// The face-connected cells around `view` that score at least 95 % of it.
EquivalentRegion EquivalentRegionOf(const Evaluation& evaluation, const FeasibleViews& feasible,
                                    uint32_t view);

// One viewcell as a region of its own.
EquivalentRegion RegionOfCell(const FeasibleViews& feasible, const FeasibleViews::CellIndex& cell);

// Two distinct walls and the last station, as a person with a tape would use them.
LocationDescription DescribeLocation(const model::PlanningView& model,
                                     const Eigen::Vector3d& position, double height);

// What the score is made of: exact. `cell_scores` is one per cell of `cells`. Sets score_by_kind
// and patch_scores (at most 5).
void SplitScore(const CellArrays& cells, std::span<const float> cell_scores,
                const PatchSet& patches, RankedView& view);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_RANK_VIEWS_H_
