// Patch cells as a binary tree: groups of patches at the top, pieces of one patch at the bottom
// (algorithm.md section 8).
#ifndef VANTAGE_CORE_PLANNING_SCORING_PATCH_TREE_H_
#define VANTAGE_CORE_PLANNING_SCORING_PATCH_TREE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/interval_constraints.h"
#include "core/planning/scoring/ordered_cells.h"

namespace vantage::planning {

// A node's cells are neighbours among the ordered cells, in whole packets; a leaf is one packet.
class PatchTree {
 public:
  struct Node {
    uint32_t begin = 0;  // cells
    uint32_t end = 0;
    uint32_t child = 0;  // the first of two; 0: a leaf
    float width = 0;     // m, the longest side of the cells' box
    CellBounds bounds;
    Eigen::AlignedBox3f targets;  // scene coordinates
    double potential = 0;         // the most that a view can gain, samples

    uint32_t size() const { return end - begin; }
    uint32_t first_packet() const { return begin / CellArrays::kPacket; }
    uint32_t end_packet() const { return (end + CellArrays::kPacket - 1) / CellArrays::kPacket; }
  };

  PatchTree() = default;  // no cells: an empty root
  // CANCELLED when that was requested on the way.
  static absl::StatusOr<PatchTree> Create(const OrderedCells& cells, parallel::Parallel& parallel,
                                          const parallel::Cancellation& cancelled = {});

  const Node& root() const { return nodes_.front(); }
  const Node& operator[](uint32_t i) const { return nodes_[i]; }
  size_t size() const { return nodes_.size(); }

 private:
  std::vector<Node> nodes_ = std::vector<Node>(1);
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_PATCH_TREE_H_
