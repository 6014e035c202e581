// Where a scan that came or went has changed what is under the open sky (algorithm.md section 4,
// 'The open sky'): also in bricks of which its own layer holds nothing, since its ray into the sky
// may have ended before them.
#ifndef VANTAGE_CORE_MODEL_MERGE_OPEN_SKY_H_
#define VANTAGE_CORE_MODEL_MERGE_OPEN_SKY_H_

#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/model_octree.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

// False only when the scan sees the sky at no voxel of the brick.
bool MayHaveSky(const ScanLayer& layer, const VoxelIndex& brick, double voxel_size);

// The bricks of the octree with false surface that the scan, when it comes, sees in the sky.
std::vector<BrickKey> BricksThatSkyClears(const ScanLayer& layer, const ModelOctree& octree,
                                          double voxel_size);

// Bricks that may get false surface back when this scan is withdrawn: they have an unknown voxel
// beside an empty one, in this scan's sky. The octree may not hold them.
std::vector<BrickKey> BricksThatSkyCleared(const ScanLayer& layer, const ModelOctree& octree,
                                           const ModelLeaf& all_empty, double voxel_size);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_OPEN_SKY_H_
