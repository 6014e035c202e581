// How many voxels of a box are not known to be empty, whatever its size, in eight look-ups: what
// shafts are tested against (algorithm.md section 8, 'Visibility of a shaft').
#ifndef VANTAGE_CORE_VISIBILITY_SUMMED_VOLUME_TABLE_H_
#define VANTAGE_CORE_VISIBILITY_SUMMED_VOLUME_TABLE_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// A summed-volume table in scene coordinates: voxels counted from the grid's corner. 4 bytes a
// voxel of the grid.
class SummedVolumeTable {
 public:
  // CANCELLED when that was requested on the way.
  static absl::StatusOr<SummedVolumeTable> Create(const OpaqueGrid& grid,
                                                  parallel::Parallel& parallel,
                                                  const parallel::Cancellation& cancelled = {});

  // Of the voxels low <= v < high, which must lie in the grid.
  uint32_t Count(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
    const size_t x0 = static_cast<size_t>(low.x());
    const size_t x1 = static_cast<size_t>(high.x());
    const size_t y0 = static_cast<size_t>(low.y()) * row_;
    const size_t y1 = static_cast<size_t>(high.y()) * row_;
    const uint32_t* bottom = sums_.get() + static_cast<size_t>(low.z()) * layer_;
    const uint32_t* top = sums_.get() + static_cast<size_t>(high.z()) * layer_;
    // Unsigned arithmetic wraps and comes out right.
    return (top[y1 + x1] - top[y1 + x0] - top[y0 + x1] + top[y0 + x0]) -
           (bottom[y1 + x1] - bottom[y1 + x0] - bottom[y0 + x1] + bottom[y0 + x0]);
  }

  const Eigen::Vector3i& size() const { return size_; }  // of the grid, voxels

 private:
  explicit SummedVolumeTable(const OpaqueGrid& grid);
  bool Sum(const OpaqueGrid& grid, parallel::Parallel& parallel,
           const parallel::Cancellation& cancelled);

  Eigen::Vector3i size_;
  size_t row_ = 0;
  size_t layer_ = 0;
  std::unique_ptr<uint32_t[]> sums_;
};

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_SUMMED_VOLUME_TABLE_H_
