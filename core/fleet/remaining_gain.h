// What views that were chosen leave for others to gain: a view counts only for the rest
// (algorithm.md section 11, 'Joint planning').
#ifndef VANTAGE_CORE_FLEET_REMAINING_GAIN_H_
#define VANTAGE_CORE_FLEET_REMAINING_GAIN_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/parallel/budget.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/constraints.h"

namespace vantage::fleet {

// The recorded density of a cell is that of the best scan so far, so that several views together
// gain, cell by cell, what the best of them does: a submodular sum. Scorers of different scanners
// may be mixed; all work on the same cells.
class RemainingGain {
 public:
  // Copies the cells.
  explicit RemainingGain(const planning::CellArrays& cells);

  // What can still be gained on, in the cells' order, q as it would be recorded by then.
  const planning::CellArrays& left() const { return left_; }
  size_t steps() const { return steps_.size(); }

  // Counts a scan from `view` as made. Returns what it gained beyond those before, samples; nothing
  // when the budget expired on the way. Adds to `rays`.
  std::optional<double> Take(const Eigen::Vector3d& view, const planning::BruteForceScorer& scorer,
                             const parallel::Budget& budget, uint64_t& rays);

  // By how much step `k` lowered what `view` gains, samples: only the cells that it changed have to
  // be looked at. Nothing when the budget expired. Thread safe.
  std::optional<double> Lowered(size_t k, const Eigen::Vector3d& view,
                                const planning::BruteForceScorer& scorer,
                                const parallel::Budget& budget, uint64_t& rays) const;
  // What Lowered() can cost at most, at a ray for each cell.
  uint64_t MostRays(size_t k) const { return steps_[k].changed.size(); }
  // The cells that step `k` gained on, by CellArrays::cell.
  const std::vector<uint32_t>& Seen(size_t k) const { return steps_[k].changed.cell; }

 private:
  struct Step {
    planning::CellArrays changed;  // as they were before
    std::vector<float> after;      // their q
  };

  void Compact();

  planning::CellArrays cells_;  // q as recorded by then
  planning::CellArrays left_;
  std::vector<Step> steps_;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_REMAINING_GAIN_H_
