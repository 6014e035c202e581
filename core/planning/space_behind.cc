#include "core/planning/space_behind.h"

#include <algorithm>

namespace vantage {
namespace {

constexpr double kLookingRange = 2.0;  // m

bool Known(VoxelState state) {
  return state == VoxelState::kEmpty || state == VoxelState::kTrueSurface ||
         state == VoxelState::kAbsorbed;
}

}  // namespace

double DepthBehind(const PlanningView& model, const VoxelIndex& voxel,
                   const Eigen::Vector3f& normal, double limit) {
  const double size = model.voxel_size();
  const Eigen::Vector3d step = -size * normal.cast<double>();
  Eigen::Vector3d point = model.Centre(voxel);
  double depth = 0;
  while (depth < limit) {
    point += step;
    const VoxelIndex at = model.At(point);
    if (!model.bounds().Contains(at) || Known(model.State(at))) break;
    depth += size;
  }
  return std::min(depth, limit);
}

double DensityWorthHaving(double required_density, double depth) {
  const double scale = 1 + depth / kLookingRange;
  return required_density * scale * scale;
}

}  // namespace vantage
