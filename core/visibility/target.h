// What a ray to a patch cell aims at (algorithm.md section 8, 'Targets').
#ifndef VANTAGE_CORE_VISIBILITY_TARGET_H_
#define VANTAGE_CORE_VISIBILITY_TARGET_H_

#include <Eigen/Core>
#include <optional>

#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// A patch cell is surrounded by its own voxels, so rays aim at a point 1.45 voxels in front of its
// centre along the normal. Where that point is not empty, at the first empty one of 1.95 and 2.45
// voxels; else at the centre of the empty face neighbour that the normal points to most; where no
// neighbour is empty there is no target and the cell is never visible. In units of voxels, model
// frame.
std::optional<Eigen::Vector3d> TargetOf(const OpaqueGrid& grid, const model::VoxelIndex& voxel,
                                        const Eigen::Vector3f& normal);

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_TARGET_H_
