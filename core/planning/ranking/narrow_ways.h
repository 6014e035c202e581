// What lies behind ways that are too narrow for the scanner (algorithm.md section 11, 'Narrow
// ways').
#ifndef VANTAGE_CORE_PLANNING_RANKING_NARROW_WAYS_H_
#define VANTAGE_CORE_PLANNING_RANKING_NARROW_WAYS_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/narrow_way.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

struct NarrowWayQuestion {
  const PlanningProblem& problem;
  // What can be gained: the problem's scored cells, or what claims leave of them.
  const CellArrays& cells;
  // m2, that the best view gains which the scanner can be carried to, without what is hidden.
  double best = 0;
  // Where the scanner may stand; none: everywhere.
  std::span<const Region> reach = {};
};

struct NarrowWays {
  std::vector<NarrowWay> ways;  // the largest gain first
  uint64_t rays = 0;            // that it took to find out
};

// The ways behind which a view gains more than twice the best, without what is hidden, and
// terminate_below at least. `done`: rays of the budget that are spent. With a work limit alone the
// same on any number of threads.
NarrowWays FindNarrowWays(const NarrowWayQuestion& question, uint64_t done,
                          const parallel::Budget& budget, parallel::Parallel& parallel);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_NARROW_WAYS_H_
