#include "core/visibility/target.h"

#include "core/model/view/target_distances.h"

namespace vantage::visibility {

std::optional<Eigen::Vector3d> TargetOf(const OpaqueGrid& grid, const model::VoxelIndex& voxel,
                                        const Eigen::Vector3f& normal) {
  const Eigen::Vector3d centre = voxel.cast<double>().array() + 0.5;
  const Eigen::Vector3d n = normal.cast<double>();
  for (const double distance : model::kTargetDistances) {
    const Eigen::Vector3d point = centre + distance * n;
    if (grid.Empty(point.array().floor().cast<int>())) return point;
  }
  std::optional<Eigen::Vector3d> best;
  double most = -2;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      model::VoxelIndex to = voxel;
      to[axis] += side;
      if (grid.Empty(to) && side * n[axis] > most) {
        most = side * n[axis];
        best = to.cast<double>().array() + 0.5;
      }
    }
  }
  return best;
}

}  // namespace vantage::visibility
