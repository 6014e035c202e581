// Whether any of some views, which lie close together, gains enough (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_BOX_GAINS_H_
#define VANTAGE_CORE_PLANNING_RANKING_BOX_GAINS_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/planning/evaluation/cell_sample.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/patch_tree.h"

namespace vantage::planning {

// What is asked of views, the same for all of them. References are kept.
struct GainTarget {
  const PlanningProblem& problem;
  double enough;  // m2, > 0
  // Each bound fails with a probability of at most exp(-log_inverse_error).
  double log_inverse_error;
};

// What was found out of views.
struct FoundGains {
  double lower = 0;  // one of them gains so much, m2
  // None gains more, m2. Where they are not settled, by what they gain if they see all cells.
  double upper = std::numeric_limits<double>::infinity();
  uint64_t rays = 0;
  bool settled = false;  // none gains enough
};

// The cells of `gains` (GainCells() of what the problem's views are scored on, of which `tree` is
// made) that may be visible from anywhere around these views, and gain anything there.
CellArrays CellsVisibleFrom(const PlanningProblem& problem, std::span<const uint32_t> views,
                            const CellArrays& gains, const PatchTree& tree);

// Looks at views, in the order given, until one is known to gain enough or none may. The views gain
// nothing but on `cells`. References are kept.
class BoxGains {
 public:
  BoxGains(const GainTarget& target, const CellArrays& cells, const parallel::Budget& budget)
      : target_(target), cells_(cells), sampler_(cells), budget_(budget) {}

  // What a view that sees all cells gains, m2.
  double potential() const { return sampler_.potential(); }

  // Casts `most_rays` at most, and what the last view takes.
  FoundGains Find(std::span<const uint32_t> views, uint64_t most_rays);

 private:
  // What a view gains on `cells` with each heading, into scores_. False when the budget ended
  // first.
  bool Score(uint32_t view, const CellArrays& cells);
  // Looks at larger and larger samples until it is known whether the view gains enough. False when
  // the budget ended first.
  bool Settle(uint32_t view);
  void RuledOut(size_t round, size_t draws, double average);

  const GainTarget& target_;
  const CellArrays& cells_;
  const CellSampler sampler_;
  const parallel::Budget& budget_;
  FoundGains found_;
  double others_ = 0;  // what views that were ruled out gain at most, m2
  std::vector<CellSample> samples_;
  std::vector<double> largest_;  // average of a view that was ruled out, by round
  std::vector<double> scores_;   // by heading
  std::vector<double> drawn_;    // the same, over all samples so far
};

// The number of samples of so many cells that are looked at before all of them are.
size_t GainSamples(size_t cells);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_BOX_GAINS_H_
