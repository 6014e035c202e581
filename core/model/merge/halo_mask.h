// A set of voxels of a brick and of the two layers of voxels around it.
#ifndef VANTAGE_CORE_MODEL_MERGE_HALO_MASK_H_
#define VANTAGE_CORE_MODEL_MERGE_HALO_MASK_H_

#include <array>
#include <bit>
#include <cstdint>

#include "core/model/carve/scan_layer.h"
#include "core/model/merge/brick_neighbourhood.h"

namespace vantage::model {

// One word a row along x, so that the neighbours in a set are found by a shift and not by looking
// at each of 125 places.
class HaloMask {
 public:
  static constexpr int kReach = 2;

  // mask_of(const T&) -> const BrickMask*, null where the brick holds none.
  template <typename T, typename MaskOf>
  HaloMask(const BrickNeighbourhood<T>& around, MaskOf&& mask_of) {
    for (size_t i = 0; i < around.all().size(); ++i) {
      const T* brick = around.all()[i];
      const BrickMask* mask = brick == nullptr ? nullptr : mask_of(*brick);
      if (mask == nullptr) continue;
      const int bx = static_cast<int>(i) % 3 - 1;
      const int by = static_cast<int>(i) / 3 % 3 - 1;
      const int bz = static_cast<int>(i) / 9 - 1;
      for (int z = First(bz); z <= Last(bz); ++z) {
        for (int y = First(by); y <= Last(by); ++y) {
          const uint64_t slice = mask->word[static_cast<size_t>(z)];
          const uint32_t row = static_cast<uint32_t>(slice >> (Brick::kSide * y)) & 0xff;
          // Bit x + kReach of the row stands for x in [-kReach, kSide + kReach).
          const int shift = bx * Brick::kSide + kReach;
          const uint32_t moved = shift < 0 ? row >> -shift : row << shift;
          row_[Row(y + Brick::kSide * by, z + Brick::kSide * bz)] |=
              static_cast<uint16_t>(moved & kWholeRow);
        }
      }
    }
  }

  // Coordinates from -kReach to kSide + kReach - 1.
  bool Has(int x, int y, int z) const { return (row_[Row(y, z)] >> (x + kReach) & 1) != 0; }

  // The brick's voxels in a row that have a face neighbour in the set: bit x of eight.
  uint32_t FaceNeighbours(int y, int z) const {
    const uint32_t row = row_[Row(y, z)];
    const uint32_t beside = row << 1 | row >> 1 | row_[Row(y - 1, z)] | row_[Row(y + 1, z)] |
                            row_[Row(y, z - 1)] | row_[Row(y, z + 1)];
    return beside >> kReach & 0xff;
  }

  // Calls fn(dx, dy, dz) for those of the set at most `reach` <= kReach from a voxel of the brick
  // on each axis, itself included; x rises fastest.
  template <typename Fn>
  void ForEachAround(int x, int y, int z, int reach, Fn&& fn) const {
    const uint32_t window = (2u << (2 * reach)) - 1;
    for (int dz = -reach; dz <= reach; ++dz) {
      for (int dy = -reach; dy <= reach; ++dy) {
        const uint32_t row = row_[Row(y + dy, z + dz)];
        for (uint32_t left = row >> (x - reach + kReach) & window; left != 0; left &= left - 1) {
          fn(std::countr_zero(left) - reach, dy, dz);
        }
      }
    }
  }

 private:
  static constexpr int kRows = Brick::kSide + 2 * kReach;
  static constexpr uint32_t kWholeRow = (1u << kRows) - 1;

  static size_t Row(int y, int z) { return static_cast<size_t>(y + kReach + kRows * (z + kReach)); }
  // Of a brick in front, the last two layers; of one behind, the first two.
  static int First(int side) { return side < 0 ? Brick::kSide - kReach : 0; }
  static int Last(int side) { return side > 0 ? kReach - 1 : Brick::kSide - 1; }

  std::array<uint16_t, kRows * kRows> row_{};
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_HALO_MASK_H_
