#include "core/planning/scoring/pose_sensitivity.h"

#include <algorithm>
#include <cmath>

#include "core/visibility/shaft.h"

namespace vantage::planning {

float PoseSensitivity::CellScore(const Eigen::Vector3d& view, const CellArrays& cells,
                                 size_t at) const {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_);
  const Eigen::AlignedBox3d box(view - reach, view + reach);
  const CellBounds cell = CellBounds::Of(cells, at, at + 1);
  uint8_t satisfied = 0;
  Interval density;
  if (!intervals_.Test(box, cell, satisfied, density)) return 0;
  // Views within the incidence limit form a convex cone, so the box lies in it if its corners do.
  // The region of at least one density at one elevation is convex as well.
  const Eigen::Vector3d p = cell.position.min().cast<double>();
  const Eigen::Vector3d n = cell.normal.min().cast<double>();
  const double cos_limit = std::cos(constraints_.scanner().max_incidence);
  double unit = std::numeric_limits<double>::infinity();  // cos i / r^2 at least
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d d = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)) - p;
    const double range = d.norm();
    const double facing = n.dot(d);
    if (facing < cos_limit * range) return 0;
    unit = std::min(unit, facing / (range * range * range));
  }
  satisfied |= kIncidenceSatisfied;
  if ((satisfied & kSensingSatisfied) != kSensingSatisfied) return 0;
  const double least = std::max(density.min, intervals_.LeastPerSteradian(box, cell) * unit);
  const double added =
      std::min(least, static_cast<double>(cells.enough[at])) - static_cast<double>(cells.q[at]);
  if (added <= 0) return 0;
  const Eigen::Vector3d target(cells.tx[at], cells.ty[at], cells.tz[at]);
  const Eigen::AlignedBox3d in_scene(box.min() / voxel_ - corner_, box.max() / voxel_ - corner_);
  if (!visibility::EntirelyVisible(grid_, in_scene, Eigen::AlignedBox3d(target, target))) return 0;
  return cells.factor[at] * static_cast<float>(added);
}

}  // namespace vantage::planning
