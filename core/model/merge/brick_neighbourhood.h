// A brick and the 26 around it, addressed by voxel offsets from the middle one.
#ifndef VANTAGE_CORE_MODEL_MERGE_BRICK_NEIGHBOURHOOD_H_
#define VANTAGE_CORE_MODEL_MERGE_BRICK_NEIGHBOURHOOD_H_

#include <array>
#include <cstddef>
#include <utility>

#include "core/model/view/voxel.h"

namespace vantage::model {

template <typename T>
class BrickNeighbourhood {
 public:
  // find(VoxelIndex brick) -> const T*, null where there is nothing.
  template <typename Find>
  BrickNeighbourhood(const VoxelIndex& brick, Find&& find) {
    size_t i = 0;
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) bricks_[i++] = find(VoxelIndex(brick + VoxelIndex(x, y, z)));
      }
    }
  }

  const T* middle() const { return bricks_[13]; }
  bool Any() const {
    for (const T* brick : bricks_) {
      if (brick != nullptr) return true;
    }
    return false;
  }
  const std::array<const T*, 27>& all() const { return bricks_; }

  // The brick of the voxel at (x, y, z), each in [-8, 15], and its local index there.
  std::pair<const T*, int> At(int x, int y, int z) const {
    const size_t i = static_cast<size_t>((x >> 3) + 1 + 3 * ((y >> 3) + 1) + 9 * ((z >> 3) + 1));
    return {bricks_[i], Brick::Local(x & 7, y & 7, z & 7)};
  }

 private:
  std::array<const T*, 27> bricks_{};
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_BRICK_NEIGHBOURHOOD_H_
