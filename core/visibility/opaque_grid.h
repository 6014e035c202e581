// What of a model is not known to be empty: what planning asks most often.
#ifndef VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
#define VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/model/view/brick_mask.h"
#include "core/model/view/planning_view.h"

namespace vantage::visibility {

// Reads the masks that the model's pages keep of their bricks, so it costs nothing to make, and
// what it answers follows a model that changes page by page. Boxes of voxels are answered for from
// coarse to fine: pages and bricks that are all alike at once, others by their masks. Covers the
// model's bounds and a margin of one opaque voxel on every side; outside all is unknown, hence
// opaque.
class OpaqueGrid {
 public:
  // `model` outlives this.
  explicit OpaqueGrid(const model::PlanningView& model);

  bool Opaque(const model::VoxelIndex& v) const {
    const model::VoxelIndex brick = model::Brick::Of(v);
    return Page(model::BrickPage::Of(brick))
        .Opaque(model::Brick::LocalOf(brick))
        .Has(model::Brick::LocalOf(v));
  }
  bool Empty(const model::VoxelIndex& v) const { return !Opaque(v); }

  // In scene coordinates: voxels counted from the corner of the box.
  bool OpaqueAt(const Eigen::Vector3i& v) const { return Opaque(v + box_.min); }
  // The same for voxels that lie near the one before, as along a line: most are in its brick, which
  // is not looked for again.
  class Walk {
   public:
    explicit Walk(const OpaqueGrid& grid) : grid_(grid) {}
    bool OpaqueAt(const Eigen::Vector3i& v) {
      const int x = v.x() + grid_.box_.min.x();
      const int y = v.y() + grid_.box_.min.y();
      const int z = v.z() + grid_.box_.min.z();
      if (mask_ == nullptr ||
          (((x >> 3) ^ brick_.x()) | ((y >> 3) ^ brick_.y()) | ((z >> 3) ^ brick_.z())) != 0) {
        brick_ = {x >> 3, y >> 3, z >> 3};
        mask_ = &grid_.Page(model::BrickPage::Of(brick_)).Opaque(model::Brick::LocalOf(brick_));
      }
      return (mask_->word[static_cast<size_t>(z & 7)] >> ((x & 7) + 8 * (y & 7)) & 1) != 0;
    }

   private:
    const OpaqueGrid& grid_;
    model::VoxelIndex brick_ = model::VoxelIndex::Zero();
    const model::BrickMask* mask_ = nullptr;
  };
  // Of the voxels low <= v < high, in scene coordinates: true where there are none.
  bool AllOpaque(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const;
  bool AllEmpty(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const;

  // The model's bounds grown by one voxel.
  const model::VoxelBox& box() const { return box_; }

  // By page coordinates; a page of nothing where all is unknown.
  const model::BrickPage& Page(const model::VoxelIndex& page) const {
    const model::BrickPage* found = model_->Page(page);
    return found == nullptr ? *unknown_ : *found;
  }

  // The rows of voxels of `layer` (z) along x for y in [first_y, end_y): bit i of word w of a row
  // is the voxel x = 64 (first_page_x + w) + i, set where it is opaque. `words` a row.
  void Rows(int layer, int first_y, int end_y, int first_page_x, size_t words,
            std::span<uint64_t> rows) const;

 private:
  const model::PlanningView* model_;
  model::VoxelBox box_;
  std::shared_ptr<const model::BrickPage> unknown_;
};

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
