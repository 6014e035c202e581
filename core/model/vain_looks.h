// Which scans looked at a surface voxel in vain: their rays should have met it and did not come
// back. What stands in between is not in the model, since empty space was seen on both sides of it.
#ifndef VANTAGE_CORE_MODEL_VAIN_LOOKS_H_
#define VANTAGE_CORE_MODEL_VAIN_LOOKS_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/brick_key.h"
#include "core/model/model_octree.h"
#include "core/model/scan_layer.h"

namespace vantage {

bool LooksInVain(const ScanLayer& layer, const SurfaceVoxel& surface, double voxel_size);

// May it, at any voxel of a brick?
bool MayLookInVain(const ScanLayer& layer, const VoxelIndex& brick, double voxel_size);

// The bricks of which it does at some voxel, as the octree has them.
std::vector<BrickKey> BricksLookedAtInVain(const ScanLayer& layer, const ModelOctree& octree,
                                           double voxel_size);

// Of the places that a voxel was looked at from in vain, those that say something beside the
// others: the nearest in each direction, nearest first, and not more than 8.
std::vector<Eigen::Vector3f> NearestLooks(const Eigen::Vector3f& centroid,
                                          std::vector<Eigen::Vector3f> from);

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_VAIN_LOOKS_H_
