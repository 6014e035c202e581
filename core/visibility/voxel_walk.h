// Walking a straight line through voxels, exactly: every voxel that the open segment enters, in
// order (Amanatides and Woo 1987).
#ifndef VANTAGE_CORE_VISIBILITY_VOXEL_WALK_H_
#define VANTAGE_CORE_VISIBILITY_VOXEL_WALK_H_

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "core/model/view/voxel.h"

namespace vantage::visibility {

// Calls visit(VoxelIndex, entry) from `from` to `to` (both in units of voxels), `entry` being the
// share of the segment at which the voxel is entered, until it returns false. Returns false when
// `visit` did.
template <typename Visit>
bool WalkVoxels(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Visit&& visit) {
  const Eigen::Vector3d direction = to - from;
  model::VoxelIndex v = from.array().floor().cast<int>();
  const model::VoxelIndex last = to.array().floor().cast<int>();
  Eigen::Vector3d next;   // share of the segment at which each axis crosses its next face
  Eigen::Vector3d width;  // share from face to face
  model::VoxelIndex step;
  for (int a = 0; a < 3; ++a) {
    if (direction[a] > 0) {
      step[a] = 1;
      next[a] = (v[a] + 1 - from[a]) / direction[a];
      width[a] = 1 / direction[a];
    } else if (direction[a] < 0) {
      step[a] = -1;
      next[a] = (v[a] - from[a]) / direction[a];
      width[a] = -1 / direction[a];
    } else {
      step[a] = 0;
      next[a] = std::numeric_limits<double>::infinity();
      width[a] = next[a];
    }
  }
  double entry = 0;
  while (true) {
    if (!visit(v, entry)) return false;
    if (v == last) return true;
    int axis = 0;
    entry = next.minCoeff(&axis);
    if (entry > 1) return true;
    v[axis] += step[axis];
    next[axis] += width[axis];
  }
}

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_VOXEL_WALK_H_
