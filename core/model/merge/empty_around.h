// Whether a scan sees through a voxel for certain.
#ifndef VANTAGE_CORE_MODEL_MERGE_EMPTY_AROUND_H_
#define VANTAGE_CORE_MODEL_MERGE_EMPTY_AROUND_H_

#include "core/model/carve/layer_bricks.h"
#include "core/model/merge/brick_neighbourhood.h"

namespace vantage::model {

// The voxel `local` of the middle brick and all 26 around it are empty: a ray that only grazes a
// surface never has all of its neighbourhood empty.
inline bool EmptyAllAround(const BrickNeighbourhood<LayerBrick>& around, int local) {
  const int x = local & 7;
  const int y = local >> 3 & 7;
  const int z = local >> 6;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto [brick, at] = around.At(x + dx, y + dy, z + dz);
        if (brick == nullptr || !brick->empty.Has(at)) return false;
      }
    }
  }
  return true;
}

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_EMPTY_AROUND_H_
