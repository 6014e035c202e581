// Dropouts: which scans sent rays at a surface voxel that should have met it and did not come back.
// What stands in between is not in the model, since empty space was seen on both sides of it.
#ifndef VANTAGE_CORE_MODEL_MERGE_DROPOUTS_H_
#define VANTAGE_CORE_MODEL_MERGE_DROPOUTS_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/model_octree.h"
#include "core/model/view/brick_key.h"

namespace vantage::model {

// Did the scan's rays to the voxel drop out?
bool IsDropout(const ScanLayer& layer, const SurfaceVoxel& surface, double voxel_size);

// May they, at any voxel of a brick?
bool MayHaveDropouts(const ScanLayer& layer, const VoxelIndex& brick, double voxel_size);

// The bricks in which they do at some voxel, as the octree has them.
std::vector<BrickKey> BricksWithDropouts(const ScanLayer& layer, const ModelOctree& octree,
                                         double voxel_size);

// Of the places from which rays to a voxel dropped out, those that say something beside the others:
// the nearest in each direction, nearest first, and not more than 8.
std::vector<Eigen::Vector3f> NearestDropouts(const Eigen::Vector3f& centroid,
                                             std::vector<Eigen::Vector3f> from);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_DROPOUTS_H_
