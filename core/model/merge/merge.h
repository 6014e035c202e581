// Brings the merged model up to date where a layer came or went.
#ifndef VANTAGE_CORE_MODEL_MERGE_MERGE_H_
#define VANTAGE_CORE_MODEL_MERGE_MERGE_H_

#include <cstddef>
#include <span>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/model_octree.h"
#include "core/model/view/brick_pages.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

enum class LayerChange { kAdded, kRemoved };

struct MergeResult {
  size_t recomputed = 0;         // bricks
  std::vector<BrickAt> changed;  // those that differ from before, by z, y, x; null: unknown now
  EmptiedBricks emptied;         // others that do: unknown before, and wholly empty now
};

// Recomputes every brick that `touched` (a layer just added to, or just removed from, `layers`) can
// influence: its own bricks, those next to them, and the few beyond to which parallel sheets lead;
// and the same around `also`, the bricks that changed in other layers. The result is a function of
// the set of layers alone.
MergeResult MergeAround(const ScanLayer& touched, LayerChange change,
                        std::span<const BrickKey> also, std::span<const ScanLayer* const> layers,
                        double voxel_size, const ModelLeaf& all_empty, parallel::Parallel& parallel,
                        ModelOctree& octree);

// The shared brick of which every voxel is empty.
ModelLeaf MakeAllEmpty();

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_MERGE_H_
