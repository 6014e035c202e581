// The bricks of a scan layer: what costs memory are those that hold surface or that a scan knows in
// part. Space that a scan saw empty as a whole is a bit a brick.
#ifndef VANTAGE_CORE_MODEL_CARVE_LAYER_BRICKS_H_
#define VANTAGE_CORE_MODEL_CARVE_LAYER_BRICKS_H_

#include <cstddef>

#include "absl/container/flat_hash_map.h"
#include "core/model/carve/surface_sums.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/brick_pages.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

struct LayerBrick {
  BrickMask empty;
  BrickMask surface;
  PackedSums sums;  // of the voxels in `surface`, in order of local

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
  size_t bytes() const;  // that they take, about
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
