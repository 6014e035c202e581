#include "core/planning/evaluation/view_lattice.h"

#include <algorithm>
#include <bit>
#include <functional>

#include "core/planning/evaluation/confidence_bounds.h"

namespace vantage::planning {

ViewLattice::ViewLattice(std::span<const Eigen::Vector3i> cells, uint64_t seed) : seed_(seed) {
  const auto draw = [seed](uint64_t axis) {
    return static_cast<int>(HashToUnit(seed, ~uint64_t{1}, axis) * (1 << kCoarsest));
  };
  origin_ = {draw(0), draw(1), draw(2)};
  for (uint32_t i = 0; i < cells.size(); ++i) {
    levels_[static_cast<size_t>(Level(cells[i]))].emplace_back(0, i);
  }
}

int ViewLattice::Level(const Eigen::Vector3i& cell) const {
  const Eigen::Vector3i at = cell - origin_;
  return std::min(std::countr_zero(static_cast<uint32_t>(at.x() | at.y() | at.z())), kCoarsest);
}

std::optional<uint32_t> ViewLattice::Next() {
  while (level_ > kCoarsest || levels_[static_cast<size_t>(level_)].empty()) {
    if (level_ == 0) return std::nullopt;
    auto& next = levels_[static_cast<size_t>(--level_)];
    for (auto& [key, i] : next) key = HashToUnit(seed_, ~uint64_t{0}, i);
    std::make_heap(next.begin(), next.end(), std::greater<>());
  }
  auto& level = levels_[static_cast<size_t>(level_)];
  std::pop_heap(level.begin(), level.end(), std::greater<>());
  const uint32_t i = level.back().second;
  level.pop_back();
  return i;
}

}  // namespace vantage::planning
