#include "core/planning/patches/space_behind.h"

#include <algorithm>

namespace vantage::planning {
namespace {

// m, from where openings are looked through: what rooms leave between a doorway or a gap in the
// furniture and where a tripod stands. A matter of rooms, not of the scanner: how many samples pass
// is its own affair. For densities that the scanner reaches from there; asked for more than that
// (by one of a degree, for 800 / m^2) it has to come nearer, and what is worth having is then more.
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

}  // namespace vantage::planning
