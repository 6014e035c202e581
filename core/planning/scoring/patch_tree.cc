#include "core/planning/scoring/patch_tree.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace vantage::planning {
namespace {

// Cells in the left half: whole packets.
uint32_t LeftSize(uint32_t size) {
  constexpr auto kPacket = static_cast<uint32_t>(CellArrays::kPacket);
  const uint32_t packets = (size + kPacket - 1) / kPacket;
  return packets / 2 * kPacket;
}

struct Keyed {
  std::array<float, 6> key;  // position (m), normal
  uint32_t cell;
};

void Halve(std::span<Keyed> cells) {
  std::array<float, 6> low = cells.front().key;
  std::array<float, 6> high = low;
  for (const Keyed& cell : cells) {
    for (size_t a = 0; a < 6; ++a) {
      low[a] = std::min(low[a], cell.key[a]);
      high[a] = std::max(high[a], cell.key[a]);
    }
  }
  size_t axis = 0;
  for (size_t a = 1; a < 6; ++a) {
    if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
  }
  const auto middle = cells.begin() + LeftSize(static_cast<uint32_t>(cells.size()));
  std::nth_element(cells.begin(), middle, cells.end(), [axis](const Keyed& a, const Keyed& b) {
    return a.key[axis] != b.key[axis] ? a.key[axis] < b.key[axis] : a.cell < b.cell;
  });
}

}  // namespace

std::vector<uint32_t> PatchOrder(const CellArrays& cells, parallel::Parallel& parallel,
                                 const parallel::Budget& budget) {
  std::vector<Keyed> keyed(cells.size());
  for (uint32_t i = 0; i < cells.size(); ++i) {
    keyed[i] = {{cells.x[i], cells.y[i], cells.z[i], cells.nx[i], cells.ny[i], cells.nz[i]}, i};
  }
  // Level by level, the ranges of a level side by side.
  std::vector<std::span<Keyed>> level = {keyed};
  std::vector<std::span<Keyed>> next;
  while (!level.empty()) {
    std::erase_if(level,
                  [](std::span<Keyed> range) { return range.size() <= CellArrays::kPacket; });
    parallel.For(level.size(), [&](size_t i) {
      if (!budget.Expired()) Halve(level[i]);
    });
    if (budget.Expired()) return {};
    next.clear();
    for (const std::span<Keyed> range : level) {
      const uint32_t left = LeftSize(static_cast<uint32_t>(range.size()));
      next.push_back(range.first(left));
      next.push_back(range.subspan(left));
    }
    level.swap(next);
  }
  std::vector<uint32_t> order(cells.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = keyed[i].cell;
  return order;
}

PatchTree::PatchTree(const CellArrays& cells, parallel::Parallel& parallel,
                     const parallel::Budget& budget) {
  nodes_.front().end = static_cast<uint32_t>(cells.size());
  for (uint32_t i = 0; i < nodes_.size(); ++i) {
    const Node node = nodes_[i];
    if (node.size() <= CellArrays::kPacket) continue;
    nodes_[i].child = static_cast<uint32_t>(nodes_.size());
    const uint32_t middle = node.begin + LeftSize(node.size());
    for (const auto& [begin, end] : {std::pair(node.begin, middle), std::pair(middle, node.end)}) {
      Node& part = nodes_.emplace_back();
      part.begin = begin;
      part.end = end;
    }
  }
  parallel.For(nodes_.size(), [&](size_t i) {
    Node& node = nodes_[i];
    if (node.begin == node.end || budget.Expired()) return;
    node.bounds = CellBounds::Of(cells, node.begin, node.end);
    node.width = static_cast<float>(node.bounds.position.sizes().maxCoeff());
    for (size_t k = node.begin; k < node.end; ++k) {
      node.targets.extend(Eigen::Vector3f(cells.tx[k], cells.ty[k], cells.tz[k]).cast<double>());
      node.potential += static_cast<double>(cells.factor[k] * (cells.enough[k] - cells.q[k]));
    }
  });
}

}  // namespace vantage::planning
