// Step D under a budget: race, decide, complete (algorithm.md section 8, 'Anytime, and honest about
// it').
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_ANYTIME_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_ANYTIME_H_

#include <cstdint>
#include <optional>
#include <span>

#include "absl/functional/function_ref.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/evaluation/evaluation_run.h"
#include "core/planning/evaluation/view_race.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

struct AnytimeOptions {
  RaceOptions race;
  double race_share = 0.8;   // of the budget, at most; the rest is for the leaders
  double confidence = 0.95;  // of all bounds together
  uint64_t seed = 1;
  double separation = 0.6;  // m, between leaders
  int leaders = 10;
  // The least number of pairs of view and cell left to complete for which the hierarchy is built.
  uint64_t hierarchy_pairs = 50'000'000;
  // By view: the factor by which a score is multiplied for ranking, for instance to rank by score
  // per minute; 0 where no scanner can go. Empty: 1 everywhere. Scores and bounds are in samples
  // all the same.
  std::span<const double> worth;
  bool complete = true;  // false: ends when the leaders are exact
  // Asked once, when the first look has an answer: what else has to be known soon. Returns the rays
  // that it cast, which count as work.
  std::optional<absl::FunctionRef<uint64_t(const Evaluation&)>> after_first_look;
};

// Scores `views` on `cells`. What is left after race and decision is completed by the hierarchy
// where enough is left and there is time to build it, otherwise view by view; both give the same
// scores up to rounding. Cells that the grid hides from a neighbourhood of views are left out.
// Heeds deadline, cancellation and work limit (rays); with a work limit alone the result does not
// depend on the number of threads.
Evaluation EvaluateViews(const BruteForceScorer& scorer, const FeasibleViews& views,
                         const OrderedCells& cells, const visibility::OpaqueGrid& grid,
                         const AnytimeOptions& options, const parallel::Budget& budget,
                         parallel::Parallel& parallel, EvaluationProgress progress);
// The same with cells in any order, view by view, every cell asked for.
Evaluation EvaluateViews(const BruteForceScorer& scorer, const FeasibleViews& views,
                         const CellArrays& cells, const AnytimeOptions& options,
                         const parallel::Budget& budget, parallel::Parallel& parallel,
                         EvaluationProgress progress);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_ANYTIME_H_
