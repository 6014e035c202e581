#include "core/registration/align/scanner_heights.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace vantage::registration {
namespace {

// m, of a bin of heights, whatever the voxels: floors are even, and centroids right, to a few
// centimetres, and a step is higher. The height comes from three bins, to a centimetre.
constexpr double kFloorBin = 0.10;
constexpr float kLevel = 0.95f;      // cosine to the vertical: 18 degrees, for noisy normals
constexpr double kLeastFloor = 2.0;  // m^2: larger than tables are
constexpr size_t kMostFloors = 3;    // heights that are tried: each costs a whole search

// Heights of level surface that much of the model lies at, largest first.
std::vector<double> Floors(const model::PlanningView& model) {
  std::map<int, double> area;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state != model::VoxelState::kTrueSurface || voxel.normal.z() < kLevel) return;
        area[static_cast<int>(std::floor(voxel.centroid.z() / kFloorBin))] += voxel.area;
      });
  std::vector<std::pair<double, double>> floors;  // area, height
  for (const auto& [bin, own] : area) {
    const auto at = [&](int other) {
      const auto it = area.find(other);
      return it == area.end() ? 0.0 : it->second;
    };
    if (at(bin - 1) > own || at(bin + 1) >= own) continue;
    const double sum = at(bin - 1) + own + at(bin + 1);
    if (sum < kLeastFloor) continue;
    const double middle = (at(bin + 1) - at(bin - 1)) / sum + bin + 0.5;
    floors.emplace_back(sum, middle * kFloorBin);
  }
  std::sort(floors.rbegin(), floors.rend());
  std::vector<double> heights;
  for (const auto& [sum, height] : floors) {
    if (heights.size() < kMostFloors) heights.push_back(height);
  }
  return heights;
}

}  // namespace

std::vector<double> ScannerHeights(const model::PlanningView& model, const FloorPlane* floor) {
  std::vector<double> heights;
  if (floor != nullptr) {
    for (const double z : Floors(model)) heights.push_back(z - floor->height);
  }
  if (!heights.empty()) return heights;
  for (const model::Station& station : model.stations()) {
    for (const double off : {-kHeightOverStation, 0.0, kHeightOverStation}) {
      const double z = station.position.z() + off;
      const bool near = std::any_of(heights.begin(), heights.end(), [z](double other) {
        return std::abs(other - z) < 0.5 * kHeightOverStation;
      });
      if (!near) heights.push_back(z);
    }
  }
  return heights;
}

}  // namespace vantage::registration
