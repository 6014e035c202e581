#include "core/planning/feasibility/floor_columns.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace vantage::planning {

FloorColumns::FloorColumns(const model::VoxelBox& box) {
  if (box.empty()) return;
  min_ = box.min.head<2>();
  size_ = (box.max - box.min).head<2>();
  begin_.assign(static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y()) + 1, 0);
}

void FloorColumns::Assign(std::span<const PlacedFloor> placed) {
  std::fill(begin_.begin(), begin_.end(), 0);
  for (const PlacedFloor& p : placed) ++begin_[p.column + 1];
  for (size_t column = 1; column < begin_.size(); ++column) begin_[column] += begin_[column - 1];
  floors_.resize(placed.size());
  std::vector<uint32_t> next = begin_;
  for (const PlacedFloor& p : placed) floors_[next[p.column]++] = p.floor;
  for (uint32_t column = 0; column < columns(); ++column) {
    std::sort(floors_.begin() + begin_[column], floors_.begin() + begin_[column + 1],
              [](const Floor& a, const Floor& b) {
                return std::tie(a.height, a.source) < std::tie(b.height, b.source);
              });
  }
}

std::vector<PlacedFloor> FloorColumns::Placed() const {
  std::vector<PlacedFloor> placed;
  placed.reserve(floors_.size());
  for (uint32_t column = 0; column < columns(); ++column) {
    for (const Floor& floor : In(column)) placed.push_back({column, floor});
  }
  return placed;
}

const Floor* FloorColumns::Near(int x, int y, float height, double most) const {
  const Floor* nearest = nullptr;
  double best = most;
  for (const Floor& floor : At(x, y)) {
    const double apart = std::abs(static_cast<double>(floor.height) - static_cast<double>(height));
    if (apart > best) continue;
    best = apart;
    nearest = &floor;
  }
  return nearest;
}

const Floor* FloorColumns::Below(int x, int y, double z) const {
  const std::span<const Floor> floors = At(x, y);
  if (floors.empty()) return nullptr;
  const Floor* below = &floors.front();
  for (const Floor& floor : floors) {
    if (static_cast<double>(floor.height) <= z) below = &floor;
  }
  return below;
}

std::vector<PlacedFloor> MeanOfLines(std::vector<PlacedFloor> placed, double apart) {
  std::sort(placed.begin(), placed.end(), [](const PlacedFloor& a, const PlacedFloor& b) {
    return std::tie(a.column, a.floor.height) < std::tie(b.column, b.floor.height);
  });
  std::vector<PlacedFloor> means;
  for (size_t begin = 0; begin < placed.size();) {
    const PlacedFloor& lowest = placed[begin];
    size_t end = begin;
    double sum = 0;
    while (end < placed.size() && placed[end].column == lowest.column &&
           static_cast<double>(placed[end].floor.height - lowest.floor.height) <= apart) {
      sum += static_cast<double>(placed[end++].floor.height);
    }
    const auto mean = static_cast<float>(sum / static_cast<double>(end - begin));
    means.push_back({lowest.column, {mean, lowest.floor.source}});
    begin = end;
  }
  return means;
}

}  // namespace vantage::planning
