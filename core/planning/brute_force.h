// The scorer that 'exact' means: from a view to every patch cell, cheap tests first, one ray to
// each target that is left (algorithm.md sections 5 and 8).
#ifndef VANTAGE_CORE_PLANNING_BRUTE_FORCE_H_
#define VANTAGE_CORE_PLANNING_BRUTE_FORCE_H_

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/constraints.h"
#include "core/planning/occlusion_scene.h"

namespace vantage {

struct ViewScore {
  double gain = 0;        // sum of the visible cells' gains, in the order of the cells
  uint64_t rays = 0;      // cast
  bool finished = false;  // false: the budget expired on the way, the rest means nothing
};

// References are kept: constraints and scene outlive the scorer. Thread safe.
class BruteForceScorer {
 public:
  // `voxel` in m. `pose_error` (m, per axis, 0: off): a cell then counts with the least it gains
  // from the view and the eight corners of the box of that half side around it, an upper bound of
  // what every pose in the box gains (algorithm.md section 8, 'Pose-error sensitivity').
  BruteForceScorer(const SensingConstraints& constraints, const OcclusionScene& scene, double voxel,
                   double pose_error)
      : constraints_(constraints), scene_(scene), voxel_(voxel), pose_error_(pose_error) {}

  // Only the budget's deadline and cancellation are heeded, about every 0.2 ms. `seen`, where
  // given, is set to 1 at the index of every needy cell that gains something.
  ViewScore Score(const Eigen::Vector3d& view, const CellArrays& cells, const Budget& budget,
                  std::span<std::atomic<uint8_t>> seen = {}) const;

  // The same, with each cell's gain (gains.size() == cells.size()).
  ViewScore ScoreCells(const Eigen::Vector3d& view, const CellArrays& cells, const Budget& budget,
                       std::span<float> gains) const;

  // What one view can cost at most.
  uint64_t MostRays(const CellArrays& cells) const {
    return cells.size() * (pose_error_ > 0 ? 9 : 1);
  }

  const SensingConstraints& constraints() const { return constraints_; }
  double voxel() const { return voxel_; }

 private:
  template <typename OnGain>
  ViewScore Run(const Eigen::Vector3d& view, const CellArrays& cells, const Budget& budget,
                OnGain&& on_gain) const;

  const SensingConstraints& constraints_;
  const OcclusionScene& scene_;
  double voxel_;
  double pose_error_;
};

// Every view against every cell. The same result on any number of threads.
std::vector<ViewScore> ScoreEveryView(const BruteForceScorer& scorer,
                                      std::span<const Eigen::Vector3d> views,
                                      const CellArrays& cells, const Budget& budget,
                                      Parallel& parallel);

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_BRUTE_FORCE_H_
