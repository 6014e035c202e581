// One bit per voxel, set where nothing is known to be empty: what planning asks of the model most
// often, in a form that answers for a row of 64 voxels at once.
#ifndef VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
#define VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"

namespace vantage::visibility {

// Covers the model's bounds and a margin of one opaque voxel on every side. Rows of bits run along
// `axes[0]`; a row is named by its coordinates on `axes[1]` and `axes[2]` (voxel indices).
class OpaqueGrid {
 public:
  // Not to be used when the budget has expired on the way.
  explicit OpaqueGrid(const model::PlanningView& model, std::array<int, 3> axes = {0, 1, 2},
                      const parallel::Budget& budget = parallel::Budget::Unlimited());

  // Everything outside the bounds is unknown, hence opaque.
  bool Opaque(const model::VoxelIndex& v) const {
    if (!box_.Contains(v)) return true;
    const int bit = v[axes_[0]] - box_.min[axes_[0]];
    const size_t row = RowIndex(v[axes_[1]], v[axes_[2]]);
    return (bits_[row * words_ + static_cast<size_t>(bit >> 6)] >> (bit & 63)) & 1;
  }
  bool Empty(const model::VoxelIndex& v) const { return !Opaque(v); }

  // With axes {0, 1, 2}, of voxels that lie in the box and are counted from its corner: one; all
  // with low <= v < high.
  bool OpaqueAt(const Eigen::Vector3i& v) const {
    const size_t row =
        static_cast<size_t>(v.y()) + static_cast<size_t>(rows_) * static_cast<size_t>(v.z());
    const auto bit = static_cast<size_t>(v.x());
    return (bits_[row * words_ + (bit >> 6)] >> (bit & 63)) & 1;
  }
  bool AllOpaque(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const;

  // The box of the bits: the model's bounds grown by one voxel.
  const model::VoxelBox& box() const { return box_; }
  size_t words_per_row() const { return words_; }

  // Bit i is voxel box().min[axes[0]] + i; bits past the box are set. `b` and `c` lie in the box.
  std::span<const uint64_t> Row(int b, int c) const {
    return {bits_.data() + RowIndex(b, c) * words_, words_};
  }

 private:
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

#endif  // VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
