// Brings the merged model up to date where a layer came or went.
#ifndef VANTAGE_CORE_MODEL_MERGE_H_
#define VANTAGE_CORE_MODEL_MERGE_H_

#include <memory>
#include <span>

#include "core/model/model_octree.h"
#include "core/model/scan_layer.h"
#include "core/parallel/parallel.h"

namespace vantage {

enum class LayerChange { kAdded, kRemoved };

// Recomputes every brick that `touched` (a layer just added to, or just removed from, `layers`) can
// have an influence on: its own bricks and those next to them; and around `also`, the bricks that
// changed in other layers. What results is a function of the
// set of layers alone. Returns the number of bricks recomputed.
size_t MergeAround(const ScanLayer& touched, LayerChange change, std::span<const BrickKey> also,
                   std::span<const ScanLayer* const> layers, double voxel_size,
                   const std::shared_ptr<const MergedBrick>& all_empty, Parallel& parallel,
                   ModelOctree& octree);

// The shared brick of which every voxel is empty.
std::shared_ptr<const MergedBrick> MakeAllEmpty();

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_MERGE_H_
