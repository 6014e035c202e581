#include "core/visibility/opaque_rows.h"

#include "absl/status/status.h"
#include "core/visibility/surface_walk.h"

namespace vantage::visibility {

absl::StatusOr<OpaqueRows> OpaqueRows::Create(const model::PlanningView& model,
                                              std::array<int, 3> axes,
                                              const parallel::Cancellation& cancelled) {
  OpaqueRows rows(model, axes);
  if (!rows.Fill(model, cancelled)) return absl::CancelledError("opaque voxels");
  return rows;
}

OpaqueRows::OpaqueRows(const model::PlanningView& model, std::array<int, 3> axes)
    : axes_(axes),
      box_{model.bounds().min - model::VoxelIndex::Ones(),
           model.bounds().max + model::VoxelIndex::Ones()} {
  const model::VoxelIndex size = box_.max - box_.min;
  rows_ = size[axes_[1]];
  words_ = (static_cast<size_t>(size[axes_[0]]) + 63) / 64;
  bits_.assign(words_ * static_cast<size_t>(rows_) * static_cast<size_t>(size[axes_[2]]),
               ~uint64_t{0});
}

// False when cancelled on the way.
bool OpaqueRows::Fill(const model::PlanningView& model, const parallel::Cancellation& cancelled) {
  size_t until_poll = 0;
  for (const model::BrickAt& at : model.bricks()) {
    if (until_poll-- == 0) {
      if (cancelled.Requested()) return false;
      until_poll = kBricksBetweenPolls;
    }
    const model::VoxelIndex origin = at.brick * model::Brick::kSide;
    std::array<int, 3> local{};
    const int first = origin[axes_[0]] - box_.min[axes_[0]];
    for (int c = 0; c < model::Brick::kSide; ++c) {
      for (int b = 0; b < model::Brick::kSide; ++b) {
        uint64_t empty = 0;
        local[axes_[1]] = b;
        local[axes_[2]] = c;
        for (int a = 0; a < model::Brick::kSide; ++a) {
          local[axes_[0]] = a;
          const model::VoxelState state =
              at.contents->state[model::Brick::Local(local[0], local[1], local[2])];
          empty |= uint64_t{state == model::VoxelState::kEmpty} << a;
        }
        if (empty == 0) continue;
        const size_t word = RowIndex(origin[axes_[1]] + b, origin[axes_[2]] + c) * words_ +
                            static_cast<size_t>(first >> 6);
        const int shift = first & 63;
        bits_[word] &= ~(empty << shift);
        if (shift > 56) bits_[word + 1] &= ~(empty >> (64 - shift));
      }
    }
  }
  return true;
}

}  // namespace vantage::visibility
