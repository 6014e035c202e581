#include "core/planning/feasibility/storeys.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>

namespace vantage::planning {
namespace {

constexpr double kLevelArea = 4.0;   // m^2 of level floor that a storey has at least: a small room
constexpr double kLevelBand = 0.25;  // m; rooms of one storey differ by thresholds and steps
constexpr double kSunken = 0.5;      // m; floor this little below a storey belongs to it
constexpr double kLevelReach = 0.5;  // m to either side that level floor is compared with,
constexpr double kLevelRise = 0.03;  // m, and by how much it may differ: no stair or ramp does

// Neither stair nor ramp.
bool IsLevel(const FloorColumns& floor, const Eigen::Vector2i& at, float height, int reach) {
  return floor.Near(at.x() + reach, at.y(), height, kLevelRise) != nullptr &&
         floor.Near(at.x(), at.y() + reach, height, kLevelRise) != nullptr;
}

}  // namespace

Storeys Storeys::Of(const FloorColumns& floor, double voxel) {
  const int reach = std::max(1, static_cast<int>(std::lround(kLevelReach / voxel)));
  std::map<int, double> area;  // m^2 of level floor by layer of voxels
  for (uint32_t column = 0; column < floor.columns(); ++column) {
    for (const Floor& here : floor.In(column)) {
      if (!here.measured() || !IsLevel(floor, floor.Voxel(column), here.height, reach)) continue;
      area[static_cast<int>(std::lround(static_cast<double>(here.height) / voxel))] +=
          voxel * voxel;
    }
  }
  Storeys storeys;
  for (auto low = area.begin(); low != area.end(); ++low) {
    if (!storeys.heights_.empty() && low->first * voxel < storeys.heights_.back() + kStoreysApart) {
      continue;
    }
    double sum = 0;
    auto most = low;  // the height of most of it is the storey's
    for (auto it = low; it != area.end() && (it->first - low->first) * voxel <= kLevelBand; ++it) {
      sum += it->second;
      if (it->second > most->second) most = it;
    }
    if (sum >= kLevelArea) storeys.heights_.push_back(most->first * voxel);
  }
  return storeys;
}

int Storeys::At(double z) const {
  int storey = 0;
  for (size_t i = 1; i < heights_.size() && z >= heights_[i] - kSunken; ++i) {
    storey = static_cast<int>(i);
  }
  return storey;
}

Storey Storeys::Describe(int storey, std::span<const NamedStorey> named) const {
  Storey told{storey, Height(static_cast<size_t>(storey)), ""};
  if (told.floor_z.has_value()) told.name = NameOfStorey(*told.floor_z, named);
  return told;
}

std::vector<Storey> Storeys::DescribeAll(std::span<const NamedStorey> named) const {
  std::vector<Storey> all;
  for (size_t storey = 0; storey < count(); ++storey) {
    all.push_back(Describe(static_cast<int>(storey), named));
  }
  return all;
}

}  // namespace vantage::planning
