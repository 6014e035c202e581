// PlanningView::ForEachSurface() that can be cancelled.
#ifndef VANTAGE_CORE_VISIBILITY_SURFACE_WALK_H_
#define VANTAGE_CORE_VISIBILITY_SURFACE_WALK_H_

#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"

namespace vantage::visibility {

inline constexpr size_t kBricksBetweenPolls = 128;

// Calls fn(VoxelIndex, VoxelState, const SurfaceVoxel&) for every voxel that has area, in the
// model's order. False when cancelled on the way.
template <typename Fn>
bool WalkSurface(const model::PlanningView& model, const parallel::Cancellation& cancelled,
                 Fn&& fn) {
  size_t until_poll = 0;
  for (const model::BrickAt& at : model.surface_bricks()) {
    if (until_poll-- == 0) {
      if (cancelled.Requested()) return false;
      until_poll = kBricksBetweenPolls;
    }
    size_t rank = 0;
    for (int word = 0; word < model::Brick::kSide; ++word) {
      for (uint64_t bits = at.contents->surface_mask[word]; bits != 0; bits &= bits - 1) {
        const int local = word * 64 + std::countr_zero(bits);
        fn(model::PlanningView::Global(at.brick, local), at.contents->state[local],
           at.contents->surface[rank++]);
      }
    }
  }
  return true;
}

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_SURFACE_WALK_H_
