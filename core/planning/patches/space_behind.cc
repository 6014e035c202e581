#include "core/planning/patches/space_behind.h"

#include <algorithm>
#include <cmath>

namespace vantage::planning {
namespace {

// The distance from which openings are looked through, m: what rooms leave between a tripod and a
// doorway or a gap in the furniture. It depends on rooms, not on the scanner. It suits densities
// that the scanner reaches from there; for a higher density (one sample per degree and 800 / m^2)
// the scanner has to come nearer, and samples would count up to a higher density.
constexpr double kLookingRange = 2.0;

bool Known(model::VoxelState state) {
  return state == model::VoxelState::kEmpty || state == model::VoxelState::kTrueSurface ||
         state == model::VoxelState::kAbsorbed;
}

}  // namespace

double DepthBehind(const model::PlanningView& model, const model::VoxelIndex& voxel,
                   const Eigen::Vector3f& normal, double limit) {
  const double size = model.voxel_size();
  const Eigen::Vector3d step = -size * normal.cast<double>();
  Eigen::Vector3d point = model.Centre(voxel);
  double depth = 0;
  while (depth < limit) {
    point += step;
    const model::VoxelIndex at = model.At(point);
    if (!model.bounds().Contains(at) || Known(model.State(at))) break;
    depth += size;
  }
  return std::min(depth, limit);
}

double DensityWorthHaving(double required_density, double depth) {
  const double scale = 1 + depth / kLookingRange;
  return required_density * scale * scale;
}

double DepthWorth(double required_density, double density) {
  // Densities are kept as floats, which says depths to some micrometres.
  constexpr double kTenth = 1e-4;  // m
  const double depth = kLookingRange * (std::sqrt(density / required_density) - 1);
  return kTenth * std::round(depth / kTenth);
}

}  // namespace vantage::planning
