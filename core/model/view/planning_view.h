// The model as planners, exports and readers see it: immutable, one per version, sharing the bricks
// that did not change with the versions before (algorithm.md section 4, 'Planning view').
#ifndef VANTAGE_CORE_MODEL_VIEW_PLANNING_VIEW_H_
#define VANTAGE_CORE_MODEL_VIEW_PLANNING_VIEW_H_

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/model/view/brick_pages.h"
#include "core/model/view/page_table.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

// A box of voxels, half open: min <= index < max.
struct VoxelBox {
  VoxelIndex min = VoxelIndex::Zero();
  VoxelIndex max = VoxelIndex::Zero();

  bool empty() const { return (max.array() <= min.array()).any(); }
  bool Contains(const VoxelIndex& v) const {
    return (v.array() >= min.array()).all() && (v.array() < max.array()).all();
  }
};

// Where a scanner stood.
struct Station {
  Eigen::Vector3d position;  // m, model frame, centre of projection
  double floor_height = 0;   // m, z of the floor below it
  bool floor_found = false;  // else floor_height is only as low as is sure to be free
  double clearance = 0.35;   // m, radius of the upright cylinder known to be free
};

class PlanningView {
 public:
  // `voxel_size` in m, > 0. Bricks not listed are unknown. Order does not matter.
  PlanningView(double voxel_size, uint64_t version, std::vector<BrickAt> bricks,
               std::vector<Station> stations);
  // A later version, sharing the pages in which nothing changed. `changed`: by z, y, x, each brick
  // once, and none that is among those emptied.
  PlanningView(const PlanningView& before, uint64_t version, std::span<const BrickAt> changed,
               std::vector<Station> stations, const EmptiedBricks& emptied = {});

  double voxel_size() const { return voxel_size_; }
  uint64_t version() const { return version_; }
  const std::vector<Station>& stations() const { return stations_; }

  // The smallest box of whole bricks that holds everything that is not unknown.
  const VoxelBox& bounds() const { return bounds_; }

  VoxelIndex At(const Eigen::Vector3d& point) const {
    return (point / voxel_size_).array().floor().cast<int>();
  }
  Eigen::Vector3d Centre(const VoxelIndex& v) const {
    return (v.cast<double>().array() + 0.5) * voxel_size_;
  }

  // kUnknown outside the bounds.
  VoxelState State(const VoxelIndex& v) const {
    const Brick* brick = Find(v);
    return brick == nullptr ? VoxelState::kUnknown : brick->state[Brick::LocalOf(v)];
  }
  bool Empty(const VoxelIndex& v) const { return State(v) == VoxelState::kEmpty; }

  // Attributes of a voxel that has area, else nothing.
  std::optional<SurfaceVoxel> Surface(const VoxelIndex& v) const {
    const Brick* brick = Find(v);
    return brick == nullptr ? std::nullopt : brick->Surface(Brick::LocalOf(v));
  }

  // The places from which rays to a voxel that has area dropped out.
  std::span<const Dropout> Dropouts(const VoxelIndex& v) const {
    const Brick* brick = Find(v);
    if (brick == nullptr || brick->dropouts.empty()) return {};
    const auto local = static_cast<uint32_t>(Brick::LocalOf(v));
    const auto begin =
        std::partition_point(brick->dropouts.begin(), brick->dropouts.end(),
                             [&](const Dropout& dropout) { return dropout.local < local; });
    const auto end =
        std::partition_point(begin, brick->dropouts.end(),
                             [&](const Dropout& dropout) { return dropout.local == local; });
    return {begin, end};
  }

  // Calls fn(VoxelIndex, VoxelState, const SurfaceVoxel&) for every voxel that has area, always in
  // the same order (bricks by z, y, x; voxels within a brick likewise).
  template <typename Fn>
  void ForEachSurface(Fn&& fn) const {
    for (const BrickAt& at : surface_bricks()) ForEachSurfaceOf(at, fn);
  }
  // The same, of one brick.
  template <typename Fn>
  static void ForEachSurfaceOf(const BrickAt& at, Fn&& fn) {
    size_t rank = 0;
    for (int word = 0; word < Brick::kSide; ++word) {
      for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1) {
        const int local = word * 64 + std::countr_zero(bits);
        fn(Global(at.brick, local), at.contents->state[local], at.contents->surface[rank++]);
      }
    }
  }

  size_t SurfaceCount() const { return surface_count_; }

  // The bricks that are not wholly unknown, in that same order.
  BrickRange bricks() const { return {pages_, brick_count_}; }

  // Of these the ones that surface may lie in, in that same order: of a hall hardly any.
  BrickRange surface_bricks() const {
    return {pages_, surface_brick_count_, BrickRange::Of::kPartlyKnown};
  }

  // The number of pages of 8 x 8 x 8 bricks, and of those among them that were made for this
  // version; all others are shared with the version before.
  size_t pages() const { return pages_.size(); }
  size_t copied_pages() const { return copied_pages_; }
  // The pages themselves, by z, y, x, and one of them by its coordinates: null where all is
  // unknown.
  const PageList& page_list() const { return pages_; }
  const BrickPage* Page(const VoxelIndex& page) const { return table_.Find(page); }

  static VoxelIndex Global(const VoxelIndex& brick, int local) {
    return {brick.x() * 8 + (local & 7), brick.y() * 8 + ((local >> 3) & 7),
            brick.z() * 8 + (local >> 6)};
  }

 private:
  void Index();

  const Brick* Find(const VoxelIndex& v) const {
    if (!bounds_.Contains(v)) return nullptr;
    const VoxelIndex brick = Brick::Of(v);
    const BrickPage* page = table_.Find(BrickPage::Of(brick));
    return page == nullptr ? nullptr : page->Find(brick);
  }

  double voxel_size_;
  uint64_t version_;
  std::vector<Station> stations_;
  PageList pages_;
  size_t copied_pages_ = 0;
  // What follows from the pages.
  VoxelBox bounds_;
  PageTable table_;
  size_t brick_count_ = 0;
  size_t surface_brick_count_ = 0;
  size_t surface_count_ = 0;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_PLANNING_VIEW_H_
