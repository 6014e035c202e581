#include "core/planning/feasibility/floor_nodes.h"

namespace vantage::planning {

FloorNodes::FloorNodes(const Eigen::Vector2i& first, const Eigen::Vector2i& size, double cell_size)
    : first_(first), size_(size), cell_size_(cell_size) {
  begin_.reserve(static_cast<size_t>(size.x()) * static_cast<size_t>(size.y()) + 1);
}

void FloorNodes::AddColumn(const std::vector<float>& heights) {
  const auto at = static_cast<int>(begin_.size() - 1);
  const Eigen::Vector2i column = first_ + Eigen::Vector2i(at % size_.x(), at / size_.x());
  for (const float height : heights) {
    column_.push_back(column);
    height_.push_back(height);
  }
  begin_.push_back(static_cast<uint32_t>(height_.size()));
}

uint32_t FloorNodes::Insert(const Eigen::Vector2i& column, float height) {
  const size_t at = Index(column);
  uint32_t node = begin_[at];
  while (node < begin_[at + 1] && height_[node] < height) ++node;
  height_.insert(height_.begin() + node, height);
  column_.insert(column_.begin() + node, column);
  for (size_t i = at + 1; i < begin_.size(); ++i) ++begin_[i];
  return node;
}

std::optional<uint32_t> FloorNodes::Under(const Eigen::Vector3d& p) const {
  const auto [begin, end] = In(ColumnAt(p));
  if (begin == end) return std::nullopt;
  uint32_t under = begin;
  for (uint32_t node = begin; node < end; ++node) {
    if (static_cast<double>(height_[node]) <= p.z()) under = node;
  }
  return under;
}

}  // namespace vantage::planning
