// The bricks of a planning view, in pages that versions share: a new version copies the pages in
// which a brick changed, and no others.
#ifndef VANTAGE_CORE_MODEL_VIEW_BRICK_PAGES_H_
#define VANTAGE_CORE_MODEL_VIEW_BRICK_PAGES_H_

#include <array>
#include <cstddef>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include "core/model/view/brick_mask.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

struct BrickAt {
  VoxelIndex brick;                       // brick coordinates: voxel index / 8
  std::shared_ptr<const Brick> contents;  // null: all of it is unknown
};

// A cube of 8 x 8 x 8 bricks.
class BrickPage {
 public:
  static constexpr int kSide = 8;
  // The page that a brick is in, in page coordinates.
  static VoxelIndex Of(const VoxelIndex& brick) {
    return {brick.x() >> 3, brick.y() >> 3, brick.z() >> 3};
  }

  // `before` (null: of nothing) with changes, which lie in one page, by z, y, x, each once.
  BrickPage(const BrickPage* before, std::span<const BrickAt* const> changes);

  // Null where all is unknown.
  const Brick* Find(const VoxelIndex& brick) const {
    return at_[static_cast<size_t>(Brick::LocalOf(brick))];
  }
  // Its bricks of a row along x; y and z in [0, 8).
  std::span<const BrickAt> Row(int y, int z) const;

  VoxelIndex coordinates() const { return Of(first_); }
  size_t size() const { return bricks_.size(); }
  size_t surface_count() const { return surface_count_; }
  // The smallest box of bricks that holds all of them, both corners included.
  const VoxelIndex& first() const { return first_; }
  const VoxelIndex& last() const { return last_; }

 private:
  std::array<const Brick*, Brick::kVoxels> at_{};
  BrickMask held_;
  std::vector<BrickAt> bricks_;  // those held, by z, y, x
  size_t surface_count_ = 0;
  VoxelIndex first_ = VoxelIndex::Zero();
  VoxelIndex last_ = VoxelIndex::Zero();
};

// In order of their coordinates: by z, y, x.
using PageList = std::vector<std::shared_ptr<const BrickPage>>;

// The bricks of a list of pages by z, y, x, across pages.
class BrickRange {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = BrickAt;
    using difference_type = std::ptrdiff_t;
    using pointer = const BrickAt*;
    using reference = const BrickAt&;

    Iterator() = default;
    explicit Iterator(std::span<const std::shared_ptr<const BrickPage>> pages);

    const BrickAt& operator*() const { return row_[at_]; }
    const BrickAt* operator->() const { return &row_[at_]; }
    Iterator& operator++() {
      if (++at_ == row_.size()) NextRow();
      return *this;
    }
    Iterator operator++(int) {
      Iterator before = *this;
      ++*this;
      return before;
    }
    bool operator==(const Iterator& other) const {
      return row_.data() == other.row_.data() && at_ == other.at_;
    }

   private:
    friend class BrickRange;
    // To the next row that has bricks, or the end.
    void NextRow();
    // Behind the last page from `first` on that shares its z, or its z and y.
    size_t EndOfLayer(size_t first) const;
    size_t EndOfStrip(size_t first) const;

    // A layer is the pages of one z, a strip those of one z and y. Rows go through a strip's pages,
    // then on by y, then on to the next strip, and only after the layer on by z.
    std::span<const std::shared_ptr<const BrickPage>> pages_;
    size_t layer_ = 0;
    size_t layer_end_ = 0;
    size_t strip_ = 0;
    size_t strip_end_ = 0;
    size_t page_ = 0;
    int y_ = 0;
    int z_ = 0;
    std::span<const BrickAt> row_;
    size_t at_ = 0;
  };
  using const_iterator = Iterator;
  using value_type = BrickAt;

  // The pages are kept: they outlive this.
  BrickRange(std::span<const std::shared_ptr<const BrickPage>> pages, size_t size)
      : pages_(pages), size_(size) {}

  Iterator begin() const { return Iterator(pages_); }
  static Iterator end() { return {}; }
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const BrickAt& front() const { return *begin(); }
  // Walks the rows before it: for a look at one, not for a loop over many.
  const BrickAt& operator[](size_t i) const;

 private:
  std::span<const std::shared_ptr<const BrickPage>> pages_;
  size_t size_;
};

// `before` with changes (by z, y, x, each brick once). Pages without any are shared; `copied` is
// the number of the others.
PageList WithChanges(const PageList& before, std::span<const BrickAt> changes, size_t& copied);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_BRICK_PAGES_H_
