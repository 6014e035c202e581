// The feasible viewcells as an octree (algorithm.md sections 7A and 8).
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_VIEW_TREE_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_VIEW_TREE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

namespace vantage::planning {

// Cells that are not split further when a cube holds at most `leaf_views` of them.
class ViewTree {
 public:
  struct Node {
    uint32_t begin = 0;  // into order()
    uint32_t end = 0;
    uint32_t child = 0;  // the first of its children, which lie side by side
    uint32_t children = 0;
    // Of the cells' centres, m.
    Eigen::AlignedBox3d centres;

    uint32_t size() const { return end - begin; }
  };

  // Cell c has its centre at (c + 0.5) * cell_size (m).
  ViewTree(std::span<const Eigen::Vector3i> cells, double cell_size, uint32_t leaf_views);

  const Node& root() const { return nodes_.front(); }
  const Node& operator[](uint32_t i) const { return nodes_[i]; }
  size_t size() const { return nodes_.size(); }

  // Indices of the given cells, in the order of the tree.
  std::span<const uint32_t> order() const { return order_; }
  std::span<const uint32_t> Views(const Node& node) const {
    return order().subspan(node.begin, node.size());
  }

 private:
  std::vector<Node> nodes_;
  std::vector<uint32_t> order_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_VIEW_TREE_H_
