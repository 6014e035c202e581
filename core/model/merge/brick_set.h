// A set of bricks, by page: sets of millions of bricks cost a bit each.
#ifndef VANTAGE_CORE_MODEL_MERGE_BRICK_SET_H_
#define VANTAGE_CORE_MODEL_MERGE_BRICK_SET_H_

#include <array>
#include <cstddef>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/brick_pages.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

class BrickSet {
 public:
  void Add(const VoxelIndex& brick) {
    pages_[KeyOf(BrickPage::Of(brick))].Set(Brick::LocalOf(brick));
  }
  // Bricks of a page, by its key.
  void Add(BrickKey page, const BrickMask& bricks);
  void Remove(BrickKey page, const BrickMask& bricks);
  void Remove(const BrickSet& others);

  bool Has(const VoxelIndex& brick) const {
    const auto it = pages_.find(KeyOf(BrickPage::Of(brick)));
    return it != pages_.end() && it->second.Has(Brick::LocalOf(brick));
  }
  // None where the set has none in the page.
  BrickMask In(BrickKey page) const;
  size_t size() const;
  const absl::flat_hash_map<BrickKey, BrickMask>& pages() const { return pages_; }

  // With the 26 bricks around each.
  BrickSet Grown() const;
  // Those of a page whose neighbour in a direction (+-1 on one axis) is not in the set.
  BrickMask EdgeIn(BrickKey page, int axis, int direction) const;
  // Ascending.
  std::vector<BrickKey> Keys() const;

 private:
  // With the two neighbours of each on one axis.
  BrickSet GrownAlong(int axis) const;

  absl::flat_hash_map<BrickKey, BrickMask> pages_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_BRICK_SET_H_
