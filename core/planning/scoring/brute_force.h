// The scorer that 'exact' means: from a view to every patch cell, cheap tests first, one ray to
// each target that is left (algorithm.md sections 5 and 8).
#ifndef VANTAGE_CORE_PLANNING_SCORING_BRUTE_FORCE_H_
#define VANTAGE_CORE_PLANNING_SCORING_BRUTE_FORCE_H_

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/pose_sensitivity.h"
#include "core/visibility/occlusion_scene.h"

namespace vantage::planning {

struct ViewScore {
  double score = 0;       // samples, sum of the visible cells' scores, in the order of the cells
  uint64_t rays = 0;      // cast
  bool finished = false;  // false: the budget expired on the way, the rest means nothing
};

// Cells of packets [begin, end).
struct PacketRange {
  uint32_t begin = 0;
  uint32_t end = 0;
  bool visible = false;  // known to be: no rays are needed
};

// That a cell gains something. Most were marked by an earlier view: what is only read stays in the
// cache of every core.
inline void MarkSeen(std::span<std::atomic<uint8_t>> seen, uint32_t cell) {
  if (seen[cell].load(std::memory_order_relaxed) == 0) {
    seen[cell].store(1, std::memory_order_relaxed);
  }
}

// References are kept: constraints and scene outlive the scorer. Thread safe.
class BruteForceScorer {
 public:
  // `voxel` in m. With `sensitivity`, a cell counts with what every pose around the view gains from
  // it (nine rays first, since they are cheap, then the shaft).
  BruteForceScorer(const SensingConstraints& constraints, const visibility::OcclusionScene& scene,
                   double voxel, const PoseSensitivity* sensitivity = nullptr)
      : constraints_(constraints), scene_(scene), voxel_(voxel), sensitivity_(sensitivity) {}

  // Only the budget's deadline and cancellation are heeded, about every 0.2 ms. `seen`, where
  // given, is set to 1 at the index of every deficient cell that gains something.
  ViewScore Score(const Eigen::Vector3d& view, const CellArrays& cells,
                  const parallel::Budget& budget, std::span<std::atomic<uint8_t>> seen = {}) const;

  // The same on some of the cells: what the others gain is known to be nothing.
  ViewScore ScorePackets(const Eigen::Vector3d& view, const CellArrays& cells,
                         std::span<const PacketRange> ranges, const parallel::Budget& budget,
                         std::span<std::atomic<uint8_t>> seen = {}) const;

  // The same, with each cell's score (cell_scores.size() == cells.size()).
  ViewScore ScoreCells(const Eigen::Vector3d& view, const CellArrays& cells,
                       const parallel::Budget& budget, std::span<float> cell_scores) const;

  // What one view can cost at most.
  uint64_t MostRays(const CellArrays& cells) const { return cells.size() * RaysPerCell(); }
  uint64_t RaysPerCell() const { return sensitivity_ != nullptr ? 9 : 1; }

  const SensingConstraints& constraints() const { return constraints_; }
  const visibility::OcclusionScene& scene() const { return scene_; }
  double voxel() const { return voxel_; }
  // By how much, m per axis, poses around a view count; 0: the view alone.
  double reach() const { return sensitivity_ != nullptr ? sensitivity_->reach() : 0; }

 private:
  template <typename OnScore>
  ViewScore Run(const Eigen::Vector3d& view, const CellArrays& cells,
                std::span<const PacketRange> ranges, const parallel::Budget& budget,
                OnScore&& on_score) const;

  const SensingConstraints& constraints_;
  const visibility::OcclusionScene& scene_;
  double voxel_;
  const PoseSensitivity* sensitivity_;
};

// Every view against every cell. The same result on any number of threads.
std::vector<ViewScore> ScoreEveryView(const BruteForceScorer& scorer,
                                      std::span<const Eigen::Vector3d> views,
                                      const CellArrays& cells, const parallel::Budget& budget,
                                      parallel::Parallel& parallel);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_BRUTE_FORCE_H_
