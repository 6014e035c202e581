// Step E: ranks the views, and collects what a person needs to know of each (algorithm.md sections
// 6 and 11).
#ifndef VANTAGE_CORE_PLANNING_RANKING_RANK_VIEWS_H_
#define VANTAGE_CORE_PLANNING_RANKING_RANK_VIEWS_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/parallel/budget.h"
#include "core/planning/evaluation/anytime.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/headings.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// Scored views by rank, equal ones by position, each at least `separation` (m) from those before it
// and from those of `others`; at most `count`, and only views that gain something and that
// `eligible` holds for.
std::vector<uint32_t> RankViews(
    const Evaluation& evaluation, const FeasibleViews& feasible, double separation, size_t count,
    std::span<const uint32_t> others = {},
    absl::FunctionRef<bool(uint32_t)> eligible = [](uint32_t) { return true; });

// The face-connected cells around `view` that score at least 95 % of it.
EquivalentRegion EquivalentRegionOf(const Evaluation& evaluation, const FeasibleViews& feasible,
                                    uint32_t view);
// The same where the scanner faces `heading` and gains `score` with it: cells whose best headings
// lie within ten degrees of it. Of others it is not known what they gain with it.
EquivalentRegion EquivalentRegionOf(const Evaluation& evaluation, const FeasibleViews& feasible,
                                    uint32_t view, const Headings& headings, size_t heading,
                                    double score);

// One viewcell as a region of its own.
EquivalentRegion RegionOfCell(const FeasibleViews& feasible, const FeasibleViews::CellIndex& cell);

// Where a view is whose place was set (ViewReport::Place): its storey where there are several, and
// the two distinct walls and the last station from which a person with a tape would find it, and
// where the scanner's front points, if that matters. Says so where the floor below was not
// measured.
LocationDescription DescribeLocation(const PlanningProblem& problem, const RankedView& view);

// For a scanner that sees a sector: sets the scores by heading of `view` and, when it is absent,
// its heading to the best one. Leaves of `cell_scores` those that the heading sees from the view's
// position. Returns their sum, samples.
double FaceHeading(const Headings& headings, const sensor::ScannerModel& scanner,
                   const CellArrays& cells, std::span<float> cell_scores, RankedView& view);

// Splits the exact score. `cell_scores` has one element for each cell of `cells`. Sets
// score_by_kind and patch_scores (at most 5).
void SplitScore(const CellArrays& cells, std::span<const float> cell_scores,
                const PatchSet& patches, RankedView& view);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_RANK_VIEWS_H_
