// What the best view gains, without what is hidden (algorithm.md section 10).
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

// What the best feasible view gains, as in all of this file its model gain and the gain of what is
// expected (RankedView::gain_without_hidden), lies between `lower` and `upper`, m2.
struct GainBounds {
  double lower = 0;
  double upper = 0;  // at the confidence of the scores' bounds
  // Some view has so much model gain, m2. No view has more model gain than `upper`: gain without
  // what is hidden is model gain and more.
  double model_gain = 0;
  uint64_t rays = 0;  // that it took to find out
};

// What the bounds are asked of.
struct GainQuestion {
  const PlanningProblem& problem;
  const CellArrays& cells;       // that the views were scored on
  const CellArrays& gains;       // GainCells() of these
  const Evaluation& evaluation;  // of all feasible views
  // What views are known to gain, m2: the largest gain without what is hidden, and the
  // largest model gain.
  double known_gain_without_hidden = 0;
  double known_model_gain = 0;
};

// As long as no view is known to gain `terminate_below` without what is hidden, those that may, by
// the bounds of their scores, are looked at, the most promising first, until one does, none is left
// or the budget ends, of which `done` rays are spent. With a work limit alone the same on any
// number of threads.
GainBounds BoundGainWithoutHidden(const GainQuestion& question, uint64_t done,
                                  const parallel::Budget& budget, parallel::Parallel& parallel);

// The largest gain without what is hidden, and model gain, among views of which they are known, m2;
// 0 when there is none.
double LargestGainWithoutHidden(std::span<const RankedView> views);
double LargestModelGain(std::span<const RankedView> views);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_
