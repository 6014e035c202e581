// Keeps potentially visible sets; views that lie close together share one.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_VISIBILITY_CACHE_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_VISIBILITY_CACHE_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/view_boxes.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/planning/scoring/potentially_visible_sets.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// References are kept.
class VisibilityCache {
 public:
  VisibilityCache(const BruteForceScorer& scorer, const FeasibleViews& views,
                  const OrderedCells& cells, const visibility::OpaqueGrid& grid);

  // `which` are about to be scored on `drawn` cells each: finds a set as soon as the work on its
  // views, past and now due, exceeds the work of finding it. Views that were not announced have
  // no set, and the same scores. As long as the budget does not expire, the result does not depend
  // on the number of threads.
  void Prepare(std::span<const uint32_t> which, size_t drawn, const parallel::Budget& budget,
               parallel::Parallel& parallel);

  // All cells except those that are hidden from the view; null when the set was not found yet.
  const std::vector<PacketRange>* PotentiallyVisibleFrom(uint32_t view) const;

 private:
  struct Entry {
    uint64_t scored = 0;  // pairs of view and cell
    std::optional<std::vector<PacketRange>> potentially_visible;
  };

  const ViewBoxes boxes_;
  const uint64_t worth_finding_;  // pairs of view and cell
  const PotentiallyVisibleSets visible_sets_;
  absl::flat_hash_map<ViewBoxes::Key, Entry> entries_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VISIBILITY_CACHE_H_
