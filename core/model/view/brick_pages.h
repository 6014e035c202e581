// The bricks of a planning view, in pages that versions share: a new version copies the pages in
// which a brick changed, and no others.
#ifndef VANTAGE_CORE_MODEL_VIEW_BRICK_PAGES_H_
#define VANTAGE_CORE_MODEL_VIEW_BRICK_PAGES_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

struct BrickAt {
  VoxelIndex brick;                       // brick coordinates: voxel index / 8
  std::shared_ptr<const Brick> contents;  // null: all of it is unknown
};

// Bricks that are wholly empty from now on, by the key of their page (brick_key.h).
struct EmptiedBricks {
  absl::flat_hash_map<BrickKey, BrickMask> by_page;
  std::shared_ptr<const Brick> contents;  // of each: nothing but empty voxels

  size_t size() const;
};

// A cube of 8 x 8 x 8 bricks. What costs memory in it are the bricks that hold surface: those that
// are wholly empty share one brick, whatever they were given as, and unknown ones take none.
class BrickPage {
 public:
  static constexpr int kSide = 8;
  static constexpr int kVoxels = kSide * Brick::kSide;  // along an edge
  // The page that a brick is in, in page coordinates.
  static VoxelIndex Of(const VoxelIndex& brick) {
    return {brick.x() >> 3, brick.y() >> 3, brick.z() >> 3};
  }

  // Of which all is unknown.
  BrickPage() : BrickPage(nullptr, VoxelIndex::Zero(), {}) {}
  // `before` (null: of nothing) with changes, which lie in the page `at` (page coordinates), by z,
  // y, x, each once. The bricks of `emptied`, which are not among them, become `empty`.
  BrickPage(const BrickPage* before, const VoxelIndex& at, std::span<const BrickAt* const> changes,
            const BrickMask& emptied = {}, const std::shared_ptr<const Brick>& empty = nullptr);

  // Null where all is unknown.
  const Brick* Find(const VoxelIndex& brick) const { return Contents(Brick::LocalOf(brick)).get(); }
  // The same by place in the page, as a brick numbers its voxels.
  const std::shared_ptr<const Brick>& Contents(int local) const {
    return bricks_[slot_[static_cast<size_t>(local)]];
  }
  // The voxels of the brick at a place that are not known to be empty.
  const BrickMask& Opaque(int local) const { return opaque_[slot_[static_cast<size_t>(local)]]; }
  // The bricks with any voxel that is not known to be empty, and those with any that is.
  const BrickMask& with_opaque() const { return with_opaque_; }
  const BrickMask& with_empty() const { return with_empty_; }
  bool all_empty() const { return all_empty_; }
  bool all_opaque() const { return all_opaque_; }
  // Bit x: the brick is not wholly unknown. y and z in [0, 8).
  uint32_t HeldInRow(int y, int z) const {
    return static_cast<uint32_t>(held_.word[static_cast<size_t>(z)] >> (kSide * y)) & 0xff;
  }

  // Bit x: the brick is neither wholly unknown nor wholly empty. All surface lies in such bricks.
  uint32_t PartlyKnownInRow(int y, int z) const {
    return HeldInRow(y, z) &
           static_cast<uint32_t>(with_opaque_.word[static_cast<size_t>(z)] >> (kSide * y));
  }

  VoxelIndex coordinates() const { return Of(first_); }
  size_t size() const { return size_; }  // bricks that are not wholly unknown
  // Of these the ones that are not wholly empty.
  size_t partly_known() const { return static_cast<size_t>((held_ & with_opaque_).Count()); }
  size_t surface_count() const { return surface_count_; }
  // The smallest box of bricks that holds all of them, both corners included.
  const VoxelIndex& first() const { return first_; }
  const VoxelIndex& last() const { return last_; }

 private:
  // Slots that mean something by themselves. Bricks with anything else have one each, by place.
  enum Slot : uint16_t { kUnknown = 0, kEmpty = 1, kFirst = 2 };

  std::array<uint16_t, Brick::kVoxels> slot_{};
  // By slot.
  std::vector<std::shared_ptr<const Brick>> bricks_;
  std::vector<BrickMask> opaque_;
  BrickMask held_;
  BrickMask with_opaque_;
  BrickMask with_empty_;
  bool all_empty_ = false;
  bool all_opaque_ = false;
  size_t size_ = 0;
  size_t surface_count_ = 0;
  VoxelIndex first_ = VoxelIndex::Zero();
  VoxelIndex last_ = VoxelIndex::Zero();
};

// In order of their coordinates: by z, y, x.
using PageList = std::vector<std::shared_ptr<const BrickPage>>;

// The bricks of a list of pages by z, y, x, across pages.
class BrickRange {
 public:
  // Those that are not wholly unknown, or of these only those that are not wholly empty, either.
  enum class Of { kKnown, kPartlyKnown };
  class Iterator {
   public:
    using iterator_category = std::input_iterator_tag;
    using value_type = BrickAt;
    using difference_type = std::ptrdiff_t;
    using pointer = const BrickAt*;
    using reference = const BrickAt&;

    Iterator() = default;
    Iterator(std::span<const std::shared_ptr<const BrickPage>> pages, Of of);

    // Valid until the iterator moves.
    const BrickAt& operator*() const { return at_; }
    const BrickAt* operator->() const { return &at_; }
    Iterator& operator++() {
      left_ &= left_ - 1;
      if (left_ == 0) {
        NextRow();
      } else {
        Load();
      }
      return *this;
    }
    Iterator operator++(int) {
      Iterator before = *this;
      ++*this;
      return before;
    }
    bool operator==(const Iterator& other) const {
      return left_ == other.left_ &&
             (left_ == 0 || (page_ == other.page_ && y_ == other.y_ && z_ == other.z_));
    }

   private:
    friend class BrickRange;
    uint32_t InRow() const;
    // To the next row that has bricks, or the end.
    void NextRow();
    // The brick at the lowest bit that is left.
    void Load();
    // Behind the last page from `first` on that shares its z, or its z and y.
    size_t EndOfLayer(size_t first) const;
    size_t EndOfStrip(size_t first) const;

    // A layer is the pages of one z, a strip those of one z and y. Rows go through a strip's pages,
    // then on by y, then on to the next strip, and only after the layer on by z.
    std::span<const std::shared_ptr<const BrickPage>> pages_;
    Of of_ = Of::kKnown;
    size_t layer_ = 0;
    size_t layer_end_ = 0;
    size_t strip_ = 0;
    size_t strip_end_ = 0;
    size_t page_ = 0;
    int y_ = 0;
    int z_ = 0;
    uint32_t left_ = 0;  // bit x: a brick of the row that is still to come, or this one; 0: the end
    BrickAt at_;
  };
  using const_iterator = Iterator;
  using value_type = BrickAt;

  // The pages are kept: they outlive this. `size`: of all of them.
  BrickRange(std::span<const std::shared_ptr<const BrickPage>> pages, size_t size,
             Of of = Of::kKnown)
      : pages_(pages), size_(size), of_(of) {}

  Iterator begin() const { return {pages_, of_}; }
  static Iterator end() { return {}; }
  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  BrickAt front() const { return *begin(); }
  // Walks the rows before it: for a look at one, not for a loop over many.
  BrickAt operator[](size_t i) const;

 private:
  std::span<const std::shared_ptr<const BrickPage>> pages_;
  size_t size_;
  Of of_;
};

// `before` with changes (by z, y, x, each brick once). Pages without any are shared; `copied` is
// the number of the others.
PageList WithChanges(const PageList& before, std::span<const BrickAt> changes,
                     const EmptiedBricks& emptied, size_t& copied);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_BRICK_PAGES_H_
