// A set of places in a cube of 8 x 8 x 8: voxels of a brick, or bricks of a page.
#ifndef VANTAGE_CORE_MODEL_VIEW_BRICK_MASK_H_
#define VANTAGE_CORE_MODEL_VIEW_BRICK_MASK_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/model/view/voxel.h"

namespace vantage::model {

// Bit local % 64 of word local / 64, one word a z-slice.
struct BrickMask {
  std::array<uint64_t, Brick::kSide> word{};

  bool Has(int local) const { return (word[local / 64] >> (local % 64) & 1) != 0; }
  void Set(int local) { word[local / 64] |= uint64_t{1} << (local % 64); }
  void Clear(int local) { word[local / 64] &= ~(uint64_t{1} << (local % 64)); }
  bool Any() const {
    uint64_t all = 0;
    for (const uint64_t w : word) all |= w;
    return all != 0;
  }
  bool All() const {
    uint64_t all = ~uint64_t{0};
    for (const uint64_t w : word) all &= w;
    return all == ~uint64_t{0};
  }
  int Count() const {
    int count = 0;
    for (const uint64_t w : word) count += std::popcount(w);
    return count;
  }
  // Calls fn(local) for each voxel of the set, in order.
  template <typename Fn>
  void ForEach(Fn&& fn) const {
    for (int w = 0; w < Brick::kSide; ++w) {
      for (uint64_t left = word[w]; left != 0; left &= left - 1) {
        fn(64 * w + std::countr_zero(left));
      }
    }
  }
  // How many voxels of the set come before `local`.
  int Rank(int local) const {
    int rank = std::popcount(word[local / 64] & ((uint64_t{1} << (local % 64)) - 1));
    for (int w = 0; w < local / 64; ++w) rank += std::popcount(word[w]);
    return rank;
  }
  // The places that are in both.
  BrickMask operator&(const BrickMask& other) const {
    BrickMask both;
    for (size_t w = 0; w < both.word.size(); ++w) both.word[w] = word[w] & other.word[w];
    return both;
  }
  bool operator==(const BrickMask&) const = default;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_BRICK_MASK_H_
