#include "core/planning/evaluation/view_tree.h"

#include <algorithm>
#include <utility>

#include "core/planning/scoring/morton.h"

namespace vantage::planning {

ViewTree::ViewTree(std::span<const Eigen::Vector3i> cells, double cell_size, uint32_t leaf_views) {
  std::vector<std::pair<uint64_t, uint32_t>> keys(cells.size());
  for (uint32_t i = 0; i < cells.size(); ++i) keys[i] = {MortonCode(cells[i]), i};
  std::sort(keys.begin(), keys.end());
  order_.resize(cells.size());
  for (size_t i = 0; i < keys.size(); ++i) order_[i] = keys[i].second;

  nodes_.emplace_back().end = static_cast<uint32_t>(cells.size());
  for (uint32_t i = 0; i < nodes_.size(); ++i) {
    Node node = nodes_[i];
    for (uint32_t k = node.begin; k < node.end; ++k) {
      node.centres.extend(
          Eigen::Vector3d((cells[order_[k]].cast<double>().array() + 0.5) * cell_size));
    }
    nodes_[i] = node;
    if (node.size() <= std::max(1u, leaf_views)) continue;
    // The highest octree level on which the cells differ.
    uint64_t differ = keys[node.begin].first ^ keys[node.end - 1].first;
    if (differ == 0) continue;
    int level = 0;
    for (; differ > 7; differ >>= 3) ++level;
    nodes_[i].child = static_cast<uint32_t>(nodes_.size());
    for (uint32_t k = node.begin; k < node.end;) {
      const uint64_t cube = keys[k].first >> (3 * level);
      Node& part = nodes_.emplace_back();
      part.begin = k;
      while (k < node.end && keys[k].first >> (3 * level) == cube) ++k;
      part.end = k;
      ++nodes_[i].children;
    }
  }
}

}  // namespace vantage::planning
