// Dropouts: which scans sent rays at a surface voxel that should have met it and did not come back.
// What stopped these rays is not in the model, since empty space was seen on both sides of it
// (algorithm.md section 4, 'What never comes').
#ifndef VANTAGE_CORE_MODEL_MERGE_DROPOUTS_H_
#define VANTAGE_CORE_MODEL_MERGE_DROPOUTS_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/model_octree.h"
#include "core/model/view/brick_key.h"

namespace vantage::model {

// True when the scan's rays to the voxel dropped out.
bool IsDropout(const ScanLayer& layer, const SurfaceVoxel& surface, double voxel_size);

// False only when the scan's rays dropped out at no voxel of the brick.
bool MayHaveDropouts(const ScanLayer& layer, const VoxelIndex& brick, double voxel_size);

// The bricks of the octree at some voxel of which the scan's rays dropped out.
std::vector<BrickKey> BricksWithDropouts(const ScanLayer& layer, const ModelOctree& octree,
                                         double voxel_size);

// Selects, from the places from which rays to a voxel dropped out, the nearest in each direction.
// The nearest comes first; at most 8.
std::vector<Eigen::Vector3f> NearestDropouts(const Eigen::Vector3f& centroid,
                                             std::vector<Eigen::Vector3f> from);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_DROPOUTS_H_
