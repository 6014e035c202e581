// What the best view may bring to the required density (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_
#define VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_

#include <cstdint>
#include <span>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

// What the best feasible view is expected to gain lies between these, m2; its model gain, where
// nothing is expected beyond the model.
struct GainBounds {
  double lower = 0;
  double upper = 0;   // at the confidence of the scores' bounds
  uint64_t rays = 0;  // that it took to find out
};

// What the bounds are asked of.
struct GainQuestion {
  const PlanningProblem& problem;
  const CellArrays& cells;       // that the views were scored on
  const CellArrays& gains;       // GainCells() of these
  const Evaluation& evaluation;  // of all feasible views
  double known = 0;              // m2 that some view is known to gain
};

// Finds what the views gain that may gain `terminate_below` by the bounds of their scores, the most
// promising first, until one is known to gain as much, none is left or the budget ends. `done`:
// rays of the budget that are spent. With a work limit alone the same on any number of threads.
GainBounds BoundModelGain(const GainQuestion& question, uint64_t done,
                          const parallel::Budget& budget, parallel::Parallel& parallel);

// The largest expected gain among views of which it is known, m2; 0 when there is none.
double LargestExpectedGain(std::span<const RankedView> views);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_
