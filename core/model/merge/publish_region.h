// What the bricks of a region of the merged model are, from what all layers say.
#ifndef VANTAGE_CORE_MODEL_MERGE_PUBLISH_REGION_H_
#define VANTAGE_CORE_MODEL_MERGE_PUBLISH_REGION_H_

#include <span>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/merge_region.h"
#include "core/model/merge/model_octree.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// The contents of the bricks that are recomputed, as the region numbers them; null: all unknown.
std::vector<ModelLeaf> PublishRegion(MergeRegion& region, std::span<const ScanLayer* const> layers,
                                     double voxel_size, const ModelLeaf& all_empty,
                                     parallel::Parallel& parallel);

// Whether two bricks, either of which may be null, say the same to the bit.
bool SameContents(const ModelLeaf& a, const ModelLeaf& b);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_PUBLISH_REGION_H_
