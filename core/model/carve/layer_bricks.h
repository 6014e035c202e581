// The bricks of a scan layer: what costs memory are those that hold surface or that a scan knows in
// part. Space that a scan saw empty as a whole is a bit a brick.
#ifndef VANTAGE_CORE_MODEL_CARVE_LAYER_BRICKS_H_
#define VANTAGE_CORE_MODEL_CARVE_LAYER_BRICKS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/brick_pages.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

// Sums over the surface points in a voxel, in integers so that the order of adding never shows.
// Positions are offsets from the voxel's lowest corner in 1/1024 of its size.
struct SurfaceSums {
  static constexpr int kUnits = 1024;

  uint32_t samples = 0;  // measured points
  uint32_t points = 0;   // measured and interpolated ones
  std::array<uint64_t, 3> sample_sum{};
  std::array<uint64_t, 3> point_sum{};
  std::array<uint64_t, 6> product_sum{};  // of points: xx, xy, xz, yy, yz, zz

  void Add(const std::array<uint32_t, 3>& offset, bool measured) {
    ++points;
    for (size_t i = 0; i < 3; ++i) point_sum[i] += offset[i];
    if (measured) {
      ++samples;
      for (size_t i = 0; i < 3; ++i) sample_sum[i] += offset[i];
    }
    size_t k = 0;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = i; j < 3; ++j) product_sum[k++] += uint64_t{offset[i]} * offset[j];
    }
  }
  void Add(const SurfaceSums& other) {
    samples += other.samples;
    points += other.points;
    for (size_t i = 0; i < 3; ++i) sample_sum[i] += other.sample_sum[i];
    for (size_t i = 0; i < 3; ++i) point_sum[i] += other.point_sum[i];
    for (size_t i = 0; i < 6; ++i) product_sum[i] += other.product_sum[i];
  }
};

struct LayerBrick {
  BrickMask empty;
  BrickMask surface;
  std::vector<SurfaceSums> sums;  // of the voxels in `surface`, in order of local

  bool WhollyEmpty() const { return empty.All(); }
  bool Any() const { return empty.Any() || surface.Any(); }
};

// Each brick once, in one of two ways: with contents of its own, or as wholly empty, a bit of its
// page. Bricks that are not there are unknown.
class LayerBricks {
 public:
  // Null where all is unknown.
  const LayerBrick* Find(BrickKey brick) const;
  // The brick with contents of its own, from now on: as it was, or unknown.
  LayerBrick& operator[](BrickKey brick);
  // Replaces a brick; one that is wholly empty becomes a bit.
  void Put(BrickKey brick, LayerBrick contents);
  // Takes a brick out, which becomes unknown.
  LayerBrick Take(BrickKey brick);
  // The bricks of a page (page coordinates), none of which is there, are wholly empty.
  void PutEmpty(const VoxelIndex& page, const BrickMask& bricks);
  void clear();

  size_t size() const;
  // Calls fn(BrickKey, const LayerBrick&) for every brick, in no particular order.
  template <typename Fn>
  void ForEach(Fn&& fn) const {
    for (const auto& [key, brick] : own_) fn(key, brick);
    for (const auto& [key, bricks] : empty_) {
      const VoxelIndex first = BrickOf(key) * BrickPage::kSide;
      bricks.ForEach([&](int local) {
        fn(KeyOf(first + VoxelIndex(local & 7, local >> 3 & 7, local >> 6)), AllEmpty());
      });
    }
  }
  // Those with contents of their own, by key, and the others by the key of their page.
  absl::flat_hash_map<BrickKey, LayerBrick>& own() { return own_; }
  const absl::flat_hash_map<BrickKey, LayerBrick>& own() const { return own_; }
  const absl::flat_hash_map<BrickKey, BrickMask>& empty() const { return empty_; }

 private:
  static const LayerBrick& AllEmpty();
  bool IsEmpty(BrickKey brick) const;
  // Forgets that a brick is wholly empty; whether it was.
  bool TakeEmpty(BrickKey brick);

  absl::flat_hash_map<BrickKey, LayerBrick> own_;
  absl::flat_hash_map<BrickKey, BrickMask> empty_;  // by page, none without a bit
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_LAYER_BRICKS_H_
