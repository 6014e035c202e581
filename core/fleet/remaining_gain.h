// What the chosen views leave for others to gain (algorithm.md section 11, 'Joint planning').
#ifndef VANTAGE_CORE_FLEET_REMAINING_GAIN_H_
#define VANTAGE_CORE_FLEET_REMAINING_GAIN_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/fleet/fleet_request.h"
#include "core/parallel/budget.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/constraints.h"
#include "core/visibility/occlusion_scene.h"

namespace vantage::fleet {

// A cell's recorded density is that of the best scan so far. So, cell by cell, several views
// together gain what the best of them gains, and the sum is submodular. Scorers of different
// scanners may be mixed; all work on the same cells.
class RemainingGain {
 public:
  explicit RemainingGain(const planning::CellArrays& cells);

  // The cells on which something can still be gained, in their order, with q as recorded after the
  // steps.
  const planning::CellArrays& left() const { return left_; }
  size_t steps() const { return steps_.size(); }

  // Counts a scan from `view` with `heading` (rad; absent: all around) as made. Returns its gain
  // beyond the steps before, samples; nothing when the budget expired on the way. Adds to `rays`.
  std::optional<double> Take(const Eigen::Vector3d& view, const planning::BruteForceScorer& scorer,
                             const parallel::Budget& budget, uint64_t& rays,
                             std::optional<double> heading = std::nullopt);

  // Counts a scan from each of `views`, in their order, as made, by the scanner of each. False when
  // the budget expired on the way. `voxel` in m.
  bool TakeAll(std::span<const PledgedView> views, const visibility::OcclusionScene& scene,
               double voxel, const parallel::Budget& budget, uint64_t& rays);

  // By how much step `k` lowered the gain of `view` with `heading`, samples. Only the cells that
  // the step changed are looked at. Nothing when the budget expired. Thread safe.
  std::optional<double> Lowered(size_t k, const Eigen::Vector3d& view,
                                const planning::BruteForceScorer& scorer,
                                const parallel::Budget& budget, uint64_t& rays,
                                std::optional<double> heading = std::nullopt) const;
  // The most rays that Lowered() can cost: one for each cell.
  uint64_t MostRays(size_t k) const { return steps_[k].changed.size(); }
  // The cells that step `k` gained on, by CellArrays::cell.
  std::span<const uint32_t> Seen(size_t k) const { return steps_[k].changed.cell; }

 private:
  struct Step {
    planning::CellArrays changed;  // the cells as they were before
    std::vector<float> after;      // their q after the step
  };

  void Compact();

  planning::CellArrays cells_;  // with q as recorded after the steps
  planning::CellArrays left_;
  std::vector<Step> steps_;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_REMAINING_GAIN_H_
