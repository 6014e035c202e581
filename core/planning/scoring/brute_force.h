// The scorer that defines exact scores: from a view to every patch cell, cheap tests first, then
// one ray to each target that is left (algorithm.md sections 5 and 8).
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
#include "core/planning/scoring/headings.h"
#include "core/planning/scoring/pose_sensitivity.h"
#include "core/visibility/occlusion_scene.h"

namespace vantage::planning {

struct ViewScore {
  double score = 0;       // samples, sum of the visible cells' scores, in the order of the cells
  uint64_t rays = 0;      // cast, also when not finished
  bool finished = false;  // false: the budget expired, and there is neither score nor heading
  size_t heading = 0;     // of Headings, where `score` is that of the best one
};

// Cells of packets [begin, end).
struct PacketRange {
  uint32_t begin = 0;
  uint32_t end = 0;
  bool visible = false;  // known to be visible: no rays are needed
};

// Marks a cell that gains something. Most cells were marked by an earlier view; a flag that is only
// read stays in the cache of every core.
inline void MarkSeen(std::span<std::atomic<uint8_t>> seen, uint32_t cell) {
  if (seen[cell].load(std::memory_order_relaxed) == 0) {
    seen[cell].store(1, std::memory_order_relaxed);
  }
}

// A view's score is what a scan that turns all around gains, unless headings are asked for.
// References are kept: constraints and scene outlive the scorer. Thread safe.
class BruteForceScorer {
 public:
  // `voxel` in m. With `sensitivity`, a cell counts with what it gains from every pose around the
  // view; nine rays are tried first, since they are cheap, then the shaft.
  BruteForceScorer(const SensingConstraints& constraints, const visibility::OcclusionScene& scene,
                   double voxel, const PoseSensitivity* sensitivity = nullptr)
      : constraints_(constraints),
        scene_(scene),
        voxel_(voxel),
        sensitivity_(sensitivity),
        headings_(constraints.scanner()) {}

  // Heeds the budget's deadline and cancellation only, about every 0.2 ms. `seen`, where given, is
  // set to 1 at the index of every deficient cell that gains something.
  ViewScore Score(const Eigen::Vector3d& view, const CellArrays& cells,
                  const parallel::Budget& budget, std::span<std::atomic<uint8_t>> seen = {}) const;

  // The same on some of the cells; the others are known to gain nothing.
  ViewScore ScorePackets(const Eigen::Vector3d& view, const CellArrays& cells,
                         std::span<const PacketRange> ranges, const parallel::Budget& budget,
                         std::span<std::atomic<uint8_t>> seen = {}) const;
  // The same, and adds each cell's score to the bin of headings() that it lies in.
  ViewScore ScoreBins(const Eigen::Vector3d& view, const CellArrays& cells,
                      std::span<const PacketRange> ranges, const parallel::Budget& budget,
                      std::span<std::atomic<uint8_t>> seen, std::span<double> by_bin) const;

  // The view's score with each of headings(); `score` and `heading` are those of the best one.
  ViewScore ScoreHeadings(const Eigen::Vector3d& view, const CellArrays& cells,
                          const parallel::Budget& budget, std::span<double> by_heading) const;

  // The same, with each cell's score (cell_scores.size() == cells.size()).
  ViewScore ScoreCells(const Eigen::Vector3d& view, const CellArrays& cells,
                       const parallel::Budget& budget, std::span<float> cell_scores) const;
  // The same to the bit, on several threads: for one view whose answer is waited for.
  ViewScore ScoreCells(const Eigen::Vector3d& view, const CellArrays& cells,
                       const parallel::Budget& budget, parallel::Parallel& parallel,
                       std::span<float> cell_scores) const;

  // The most rays that one view can cost.
  uint64_t MostRays(const CellArrays& cells) const { return cells.size() * RaysPerCell(); }
  uint64_t RaysPerCell() const { return sensitivity_ != nullptr ? 9 : 1; }

  const SensingConstraints& constraints() const { return constraints_; }
  const visibility::OcclusionScene& scene() const { return scene_; }
  double voxel() const { return voxel_; }
  const Headings& headings() const { return headings_; }
  // Half side of the box of poses that count around a view, m; 0: the view only.
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
  Headings headings_;
};

// Every view against every cell. The same result on any number of threads.
std::vector<ViewScore> ScoreEveryView(const BruteForceScorer& scorer,
                                      std::span<const Eigen::Vector3d> views,
                                      const CellArrays& cells, const parallel::Budget& budget,
                                      parallel::Parallel& parallel);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_BRUTE_FORCE_H_
