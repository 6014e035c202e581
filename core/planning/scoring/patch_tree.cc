#include "core/planning/scoring/patch_tree.h"

#include <utility>

#include "absl/status/status.h"

namespace vantage::planning {

absl::StatusOr<PatchTree> PatchTree::Create(const OrderedCells& cells, parallel::Parallel& parallel,
                                            const parallel::Cancellation& cancelled) {
  PatchTree tree;
  std::vector<Node>& nodes = tree.nodes_;
  nodes.front().end = static_cast<uint32_t>(cells.size());
  for (uint32_t i = 0; i < nodes.size(); ++i) {
    const Node node = nodes[i];
    if (node.size() <= CellArrays::kPacket) continue;
    nodes[i].child = static_cast<uint32_t>(nodes.size());
    const uint32_t middle = node.begin + OrderedCells::LeftSize(node.size());
    for (const auto& [begin, end] : {std::pair(node.begin, middle), std::pair(middle, node.end)}) {
      Node& part = nodes.emplace_back();
      part.begin = begin;
      part.end = end;
    }
  }
  parallel.For(nodes.size(), [&](size_t i) {
    Node& node = nodes[i];
    if (node.begin == node.end || cancelled.Requested()) return;
    node.bounds = CellBounds::Of(cells, node.begin, node.end);
    node.width = static_cast<float>(node.bounds.position.cast<double>().sizes().maxCoeff());
    for (size_t k = node.begin; k < node.end; ++k) {
      node.targets.extend(Eigen::Vector3f(cells.tx[k], cells.ty[k], cells.tz[k]));
      node.potential += static_cast<double>(cells.factor[k] * (cells.enough[k] - cells.q[k]));
    }
  });
  if (cancelled.Requested()) return absl::CancelledError("patch tree");
  return tree;
}

}  // namespace vantage::planning
