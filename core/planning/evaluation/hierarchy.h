// The hierarchical scorer: an octree of viewcells against a tree of patches, both split only where
// their relation is mixed (algorithm.md section 8).
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_HIERARCHY_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_HIERARCHY_H_

#include <Eigen/Geometry>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/shaft_classifier.h"
#include "core/planning/evaluation/view_tree.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/planning/scoring/patch_tree.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

struct HierarchyOptions {
  // epsilon: a pair counts with the middle of its density's bounds when they differ by no more than
  // this share of the upper one. 0: only when the density is certain to be enough, so that scores
  // are those of brute force. Not used with pose sensitivity.
  double tolerance = 0;
  // Views of a leaf. A leaf of patches is a packet of 8 cells; so a pair of leaves has at most 128
  // pairs of view and cell, which rays decide for each view across all its packets. 1: not batched.
  uint32_t leaf_views = 16;
  uint32_t block_views = 256;  // views culled together, the unit of parallel work
  // Shafts of at least this many pairs are tested for being entirely visible. For smaller ones the
  // test costs more than their rays.
  uint32_t visible_pairs = 64;
};

// Neighbouring views and what any of them may see.
struct ViewBlock {
  uint32_t node = 0;     // of the view tree
  double certain = 0;    // samples that every view of the block gains
  double potential = 0;  // samples; no view of the block gains more
  // Nodes of the patch tree, in the order of the cells. Nodes that are left out gain nothing from
  // the block or count in `certain`.
  struct Candidate {
    uint32_t node = 0;
    uint8_t satisfied = 0;
  };
  std::vector<Candidate> candidates;
};

// Scores views against cells by their two trees (algorithm.md section 8, 'The hierarchy'). Blocks
// of views are independent of one another, and a deadline leaves each view either exact or
// unscored. References are kept. Thread safe.
class HierarchicalScorer {
 public:
  // View i is the centre of viewcell i (FeasibleViews::cells()). Goes down from the roots of the
  // trees to the blocks; `seen` as for BruteForceScorer::Score(). CANCELLED when the budget expired
  // on the way.
  static absl::StatusOr<std::unique_ptr<HierarchicalScorer>> Create(
      const BruteForceScorer& scorer, const visibility::OpaqueGrid& grid, const OrderedCells& cells,
      std::span<const Eigen::Vector3i> viewcells, double viewcell_size,
      const HierarchyOptions& options, const parallel::Budget& budget, parallel::Parallel& parallel,
      std::span<std::atomic<uint8_t>> seen = {});
  HierarchicalScorer(const HierarchicalScorer&) = delete;
  HierarchicalScorer& operator=(const HierarchicalScorer&) = delete;

  const std::vector<ViewBlock>& blocks() const { return blocks_; }
  std::span<const uint32_t> Views(const ViewBlock& block) const {
    return views_.Views(views_[block.node]);
  }

  // The lower levels of a block: exact scores of all its views; `scores` is parallel to
  // Views(block). When the budget's deadline passes, the remaining views are left unfinished.
  HierarchyCounts ScoreBlock(const ViewBlock& block, const parallel::Budget& budget,
                             std::span<ViewScore> scores,
                             std::span<std::atomic<uint8_t>> seen = {}) const;

  // The same in parts that may be scored in parallel, each into its place in `scores`.
  size_t Parts(const ViewBlock& block) const;
  HierarchyCounts ScorePart(const ViewBlock& block, size_t part, const parallel::Budget& budget,
                            std::span<ViewScore> scores,
                            std::span<std::atomic<uint8_t>> seen = {}) const;

  // One view, from its block's candidates.
  ViewScore ScoreView(uint32_t view, const parallel::Budget& budget,
                      std::span<std::atomic<uint8_t>> seen = {}) const;

  const PatchTree& patches() const { return patches_; }

 private:
  using Candidates = std::vector<ViewBlock::Candidate>;

  HierarchicalScorer(const BruteForceScorer& scorer, visibility::OpaqueGrid grid,
                     const OrderedCells& cells, std::span<const Eigen::Vector3i> viewcells,
                     double viewcell_size, const HierarchyOptions& options, PatchTree patches);

  // The upper levels: finds the blocks. False when the budget expired on the way.
  bool Cull(const parallel::Budget& budget, parallel::Parallel& parallel,
            std::span<std::atomic<uint8_t>> seen);
  void Refine(const ViewBox& pass, const ViewBlock::Candidate& candidate, Candidates& out,
              double& certain, HierarchyCounts& counts, std::span<std::atomic<uint8_t>> seen) const;
  // False when the budget expired on the way.
  bool RefineAll(const ViewBox& pass, std::span<const ViewBlock::Candidate> candidates,
                 const parallel::Budget& budget, Candidates& out, double& certain,
                 HierarchyCounts& counts, std::span<std::atomic<uint8_t>> seen) const;
  Eigen::Vector3d Centre(uint32_t view) const {
    return (viewcells_[view].cast<double>().array() + 0.5) * viewcell_size_;
  }
  // The most that a view of the block can gain, samples.
  double PotentialOf(const ViewBlock& block) const;
  // The score of a view that gains `certain` on all cells but those of `ranges`.
  ViewScore ScoreOn(uint32_t view, std::span<const PacketRange> ranges, double certain,
                    const parallel::Budget& budget, std::span<std::atomic<uint8_t>> seen) const;
  struct Descent;
  void Descend(Descent& descent, uint32_t node, std::span<const ViewBlock::Candidate> candidates,
               double certain) const;

  const BruteForceScorer& scorer_;
  const OrderedCells& cells_;
  std::span<const Eigen::Vector3i> viewcells_;
  double viewcell_size_;
  HierarchyOptions options_;
  visibility::OpaqueGrid grid_;  // summed
  ShaftClassifier classifier_;
  PatchTree patches_;
  ViewTree views_;
  std::vector<ViewBlock> blocks_;
  std::vector<uint32_t> block_of_;
};

// Every view against every cell by the hierarchy. The same result on any number of threads.
std::vector<ViewScore> ScoreEveryView(const HierarchicalScorer& scorer,
                                      const parallel::Budget& budget, parallel::Parallel& parallel);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_HIERARCHY_H_
