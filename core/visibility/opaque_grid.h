// What of a model is not known to be empty: what planning asks most often.
#ifndef VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
#define VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "absl/status/statusor.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/visibility/summed_volume_table.h"

namespace vantage::visibility {

// Reads the masks that the model's pages keep of their bricks, so it costs nothing to make, and
// what it answers follows a model that changes page by page. Boxes of voxels are answered for from
// coarse to fine: pages and bricks that are all alike at once, others by their masks. Covers the
// model's bounds and a margin of one opaque voxel on every side; outside all is unknown, hence
// opaque. Copies share what they hold.
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
    explicit Walk(const OpaqueGrid& grid) : grid_(grid), min_(grid.box_.min) {}
    bool OpaqueAt(const Eigen::Vector3i& v) { return OpaqueAt(v.x(), v.y(), v.z()); }
    // By numbers, which stay in registers: to read a vector that was just written piece by piece
    // takes as long as all the rest.
    bool OpaqueAt(int x, int y, int z) {
      x += min_.x();
      y += min_.y();
      z += min_.z();
      if ((((x >> 3) ^ x_) | ((y >> 3) ^ y_) | ((z >> 3) ^ z_)) != 0 || mask_ == nullptr) {
        Enter(x >> 3, y >> 3, z >> 3);
      }
      return (mask_->word[static_cast<size_t>(z & 7)] >> ((x & 7) + 8 * (y & 7)) & 1) != 0;
    }

   private:
    // By brick coordinates. Not in the header, so that what is done for each voxel is inlined.
    void Enter(int x, int y, int z);

    const OpaqueGrid& grid_;
    const model::VoxelIndex min_;
    int x_ = 0;  // of the brick
    int y_ = 0;
    int z_ = 0;
    const model::BrickMask* mask_ = nullptr;  // null: none was looked for yet
  };

  // The same grid for whoever asks of very many boxes: where its box is small it answers for them
  // by a summed volume table, with the same answers. CANCELLED when that was requested on the way.
  absl::StatusOr<OpaqueGrid> Summed(parallel::Parallel& parallel,
                                    const parallel::Cancellation& cancelled = {}) const;
  bool summed() const { return table_ != nullptr; }

  // Of the voxels low <= v < high, in scene coordinates, which lie in the box: true where there are
  // none.
  bool AllOpaque(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
    if ((low.array() >= high.array()).any()) return true;
    return table_ == nullptr
               ? AllOpaqueByBricks(low, high)
               : table_->Count(low, high) == static_cast<uint32_t>((high - low).prod());
  }
  bool AllEmpty(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
    if ((low.array() >= high.array()).any()) return true;
    return table_ == nullptr ? AllEmptyByBricks(low, high) : table_->Count(low, high) == 0;
  }

  const model::PlanningView& model() const { return *model_; }
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
  bool AllOpaqueByBricks(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const;
  bool AllEmptyByBricks(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const;

  const model::PlanningView* model_;
  model::VoxelBox box_;
  std::shared_ptr<const model::BrickPage> unknown_;
  std::shared_ptr<const SummedVolumeTable> table_;  // null: boxes are answered for by bricks
};

// Bricks with both empty and opaque voxels: what a model's surface lies in.
size_t MixedBricks(const model::PlanningView& model);

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
