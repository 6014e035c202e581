// Seeks a view that is worth a scan, until one is found or none may be left (algorithm.md section
// 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_GAIN_SEARCH_H_
#define VANTAGE_CORE_PLANNING_RANKING_GAIN_SEARCH_H_

#include <cstdint>
#include <limits>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/box_gains.h"
#include "core/planning/ranking/gain_bounds.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/planning/scoring/patch_tree.h"

namespace vantage::planning {

// First the best view alone, which mostly gains enough; then box by box of views that lie close
// together: which cells may be visible from there, and how much they gain at most; then view by
// view, on larger and larger samples of these cells.
class GainSearch {
 public:
  // `gains` are the GainCells() of `cells`, on which views are scored, and `most_gain_per_sample`
  // the MostGainPerSample() of both. References are kept.
  GainSearch(const PlanningProblem& problem, const OrderedCells& cells, const CellArrays& gains,
             double most_gain_per_sample);

  // Some view is known to gain so much without what is hidden, and some so much model gain, m2.
  void Know(double gain_without_hidden, double model_gain);

  // Seeks until a view is known to gain `terminate_below` without what is hidden, none may any
  // more, or the budget ends; goes on where it ended before. `evaluation` is of all feasible views,
  // on `cells`: the bounds of their scores spare looking at views, and the best are looked at
  // first. Where the budget is far from what an answer takes, only the best is. Returns the rays
  // that it cast, beside `done` that are spent. With a work limit alone the same on any number of
  // threads.
  uint64_t Seek(const Evaluation& evaluation, uint64_t done, const parallel::Budget& budget,
                parallel::Parallel& parallel);

  // What is known by now. The upper bound holds with the confidence of the problem.
  GainBounds Bounds(const Evaluation& evaluation) const;

 private:
  struct Box {
    std::vector<uint32_t> views;
    bool settled = false;
    double upper = std::numeric_limits<double>::infinity();  // of what they gain, m2
  };

  bool Enough() const;
  void ListBoxes();
  // Whether the budget, of which `done` rays are spent, may last until all views are settled.
  bool MayEnd(const GainTarget& target, const Evaluation& evaluation, uint64_t done,
              const parallel::Budget& budget, int threads) const;
  // Looks at the best view by the evaluation so far. Returns the rays.
  uint64_t LookAtBest(const GainTarget& target, const Evaluation& evaluation,
                      const parallel::Budget& budget);
  // The most that a view may gain by the bounds of its score, m2.
  double MostOf(const ViewEstimate& view) const;
  // The boxes that are not settled, those with the best views first.
  std::vector<uint32_t> Order(const Evaluation& evaluation) const;
  FoundGains Look(const Box& box, const GainTarget& target, const PatchTree& tree,
                  const Evaluation& evaluation, uint64_t most_rays,
                  const parallel::Budget& budget) const;

  const PlanningProblem& problem_;
  const OrderedCells& cells_;
  const CellArrays& gains_;
  const double per_sample_;  // m2 of gain that a sample of a score stands for at most
  double gain_without_hidden_ = 0;
  double model_gain_ = 0;
  double potential_ = 0;    // m2, of all cells; once a search has begun
  bool looked_ = false;     // at the best view
  std::vector<Box> boxes_;  // once a search has begun
};

// What one search alone is asked.
struct GainQuestion {
  const PlanningProblem& problem;
  const OrderedCells& cells;     // that the views were scored on
  const CellArrays& gains;       // GainCells() of these
  const Evaluation& evaluation;  // of all feasible views
  // What views are known to gain, m2: the largest gain without what is hidden, and the largest
  // model gain.
  double known_gain_without_hidden = 0;
  double known_model_gain = 0;
};
GainBounds BoundGainWithoutHidden(const GainQuestion& question, uint64_t done,
                                  const parallel::Budget& budget, parallel::Parallel& parallel);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_GAIN_SEARCH_H_
