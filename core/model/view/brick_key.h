// A brick's coordinates as one number.
#ifndef VANTAGE_CORE_MODEL_VIEW_BRICK_KEY_H_
#define VANTAGE_CORE_MODEL_VIEW_BRICK_KEY_H_

#include <cstdint>

#include "core/model/view/voxel.h"

namespace vantage::model {

using BrickKey = uint64_t;
// Brick coordinates of at most 21 bits each, packed so that they sort by z, y, x.
inline BrickKey KeyOf(const VoxelIndex& brick) {
  constexpr int64_t kBias = 1 << 20;
  return static_cast<uint64_t>(brick.z() + kBias) << 42 |
         static_cast<uint64_t>(brick.y() + kBias) << 21 | static_cast<uint64_t>(brick.x() + kBias);
}
inline VoxelIndex BrickOf(BrickKey key) {
  constexpr int64_t kBias = 1 << 20;
  constexpr uint64_t kMask = (1 << 21) - 1;
  return {static_cast<int>(static_cast<int64_t>(key & kMask) - kBias),
          static_cast<int>(static_cast<int64_t>(key >> 21 & kMask) - kBias),
          static_cast<int>(static_cast<int64_t>(key >> 42) - kBias)};
}

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_BRICK_KEY_H_
