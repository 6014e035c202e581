// What of a model is not known to be empty: what planning asks most often, in a form that answers
// for a row of 64 voxels at once.
#ifndef VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
#define VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/visibility/opaque_rows.h"

namespace vantage::visibility {

// Covers the model's bounds and a margin of one opaque voxel on every side. Rows run along x.
class OpaqueGrid {
 public:
  explicit OpaqueGrid(const model::PlanningView& model)
      : rows_(OpaqueRows::Create(model, {0, 1, 2}).value()) {}
  // CANCELLED when that was requested on the way.
  static absl::StatusOr<OpaqueGrid> Create(const model::PlanningView& model,
                                           const parallel::Cancellation& cancelled);

  // Everything outside the bounds is unknown, hence opaque.
  bool Opaque(const model::VoxelIndex& v) const {
    return !box().Contains(v) || OpaqueAt(v - box().min);
  }
  bool Empty(const model::VoxelIndex& v) const { return !Opaque(v); }

  // Of voxels that lie in the box and are counted from its corner: one; all with low <= v < high.
  bool OpaqueAt(const Eigen::Vector3i& v) const {
    const auto bit = static_cast<size_t>(v.x());
    return (rows_.RowFromCorner(v.y(), v.z())[bit >> 6] >> (bit & 63)) & 1;
  }
  bool AllOpaque(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const;

  // The box of the bits: the model's bounds grown by one voxel.
  const model::VoxelBox& box() const { return rows_.box(); }
  size_t words_per_row() const { return rows_.words_per_row(); }
  // Bit i is voxel box().min.x() + i; bits past the box are set. `y` and `z` lie in the box.
  std::span<const uint64_t> Row(int y, int z) const { return rows_.Row(y, z); }
  const OpaqueRows& rows() const { return rows_; }

 private:
  explicit OpaqueGrid(OpaqueRows rows) : rows_(std::move(rows)) {}

  OpaqueRows rows_;  // axes {0, 1, 2}
};

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_OPAQUE_GRID_H_
