// One bit per voxel, set where nothing is known to be empty, in rows along any axis.
#ifndef VANTAGE_CORE_VISIBILITY_OPAQUE_ROWS_H_
#define VANTAGE_CORE_VISIBILITY_OPAQUE_ROWS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"

namespace vantage::visibility {

// Covers the model's bounds and a margin of one opaque voxel on every side. Rows of bits run along
// `axes[0]`; a row is named by its coordinates on `axes[1]` and `axes[2]` (voxel indices).
class OpaqueRows {
 public:
  // CANCELLED when that was requested on the way.
  static absl::StatusOr<OpaqueRows> Create(const model::PlanningView& model,
                                           std::array<int, 3> axes,
                                           const parallel::Cancellation& cancelled = {});

  // The box of the bits: the model's bounds grown by one voxel.
  const model::VoxelBox& box() const { return box_; }
  size_t words_per_row() const { return words_; }

  // Bit i is voxel box().min[axes[0]] + i; bits past the box are set. `b` and `c` lie in the box.
  std::span<const uint64_t> Row(int b, int c) const {
    return {bits_.data() + RowIndex(b, c) * words_, words_};
  }
  // The same by coordinates from the box's corner.
  std::span<const uint64_t> RowFromCorner(int b, int c) const {
    const size_t row = static_cast<size_t>(b) + static_cast<size_t>(rows_) * static_cast<size_t>(c);
    return {bits_.data() + row * words_, words_};
  }

 private:
  OpaqueRows(const model::PlanningView& model, std::array<int, 3> axes);
  bool Fill(const model::PlanningView& model, const parallel::Cancellation& cancelled);
  size_t RowIndex(int b, int c) const {
    return static_cast<size_t>(b - box_.min[axes_[1]]) +
           static_cast<size_t>(rows_) * static_cast<size_t>(c - box_.min[axes_[2]]);
  }

  std::array<int, 3> axes_;
  model::VoxelBox box_;
  int rows_ = 0;      // along axes_[1]
  size_t words_ = 0;  // per row
  std::vector<uint64_t> bits_;
};

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_OPAQUE_ROWS_H_
