// The union of the scans' layers in one brick: true over empty over unknown (algorithm.md
// section 4, 'Merge').
#ifndef VANTAGE_CORE_MODEL_MERGE_UNITE_H_
#define VANTAGE_CORE_MODEL_MERGE_UNITE_H_

#include <memory>
#include <span>

#include "core/model/merge/merged_brick.h"

namespace vantage::model {

// `own`: the brick in each of `layers`, null where the layer holds nothing of it. Null when no
// layer does. A surface voxel is erased when at least two scans, and more than measured it, saw it
// empty together with all 26 voxels around it: a person who left, a door that moved. A ray that
// only grazes a surface never has all of its neighbourhood empty.
std::shared_ptr<const UnitedBrick> Unite(const VoxelIndex& brick,
                                         std::span<const LayerBrick* const> own,
                                         std::span<const ScanLayer* const> layers);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_UNITE_H_
