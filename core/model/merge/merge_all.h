// Makes the whole merged model anew where many layers have changed at once.
#ifndef VANTAGE_CORE_MODEL_MERGE_MERGE_ALL_H_
#define VANTAGE_CORE_MODEL_MERGE_MERGE_ALL_H_

#include <span>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/merge.h"
#include "core/model/merge/model_octree.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// Recomputes every brick of which any layer says anything, and those next to them; `octree` may
// hold anything before. What it holds afterwards is what MergeAround() makes of it as the layers
// come one after the other, to the bit, since both are functions of the set of layers. Each brick
// is computed once, where each of the layers would have it computed again.
MergeResult MergeAll(std::span<const ScanLayer* const> layers, double voxel_size,
                     const ModelLeaf& all_empty, parallel::Parallel& parallel, ModelOctree& octree);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_MERGE_ALL_H_
