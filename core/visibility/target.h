// The point that a ray to a patch cell aims at (algorithm.md section 8, 'Targets').
#ifndef VANTAGE_CORE_VISIBILITY_TARGET_H_
#define VANTAGE_CORE_VISIBILITY_TARGET_H_

#include <Eigen/Core>
#include <optional>

#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// The target of a cell at `voxel`, in units of voxels, model frame: an empty point in front of the
// cell along `normal`, or the centre of an empty face neighbour. Nothing where no such neighbour is
// empty: the cell is then never visible.
std::optional<Eigen::Vector3d> TargetOf(const OpaqueGrid& grid, const model::VoxelIndex& voxel,
                                        const Eigen::Vector3f& normal);

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_TARGET_H_
