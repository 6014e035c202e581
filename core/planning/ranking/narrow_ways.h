// What lies behind ways that are too narrow for the scanner (algorithm.md section 11, 'Narrow
// ways').
#ifndef VANTAGE_CORE_PLANNING_RANKING_NARROW_WAYS_H_
#define VANTAGE_CORE_PLANNING_RANKING_NARROW_WAYS_H_

#include <cstdint>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/narrow_way.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::planning {

struct NarrowWays {
  std::vector<NarrowWay> ways;  // the largest gain first
  uint64_t rays = 0;            // that it took to find out
};

// The ways behind which a view gains more than twice `best`, what the best view gains that the
// scanner can be carried to (m2; both without what is hidden), and terminate_below at least.
// `done`: rays of the budget that are spent. With a work limit alone the same on any number of
// threads.
NarrowWays FindNarrowWays(const PlanningProblem& problem, double best, uint64_t done,
                          const parallel::Budget& budget, parallel::Parallel& parallel);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_NARROW_WAYS_H_
