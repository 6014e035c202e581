// How many voxels of a box are opaque, whatever its size, in eight look-ups (after Crow 1984): what
// shafts are tested against where the model's box is small (algorithm.md section 8, 'Visibility of
// a shaft').
#ifndef VANTAGE_CORE_VISIBILITY_SUMMED_VOLUME_TABLE_H_
#define VANTAGE_CORE_VISIBILITY_SUMMED_VOLUME_TABLE_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"

namespace vantage::visibility {

// Over a box of `size` voxels, counted from its corner. It is dense, so it is for small boxes only.
class SummedVolumeTable {
 public:
  // Voxels of the largest box that has a table, which is 64 MiB. A storey of 500 m2 with voxels of
  // 5 cm fits, whose plan takes several times as much for its surface. Beyond, memory has to go
  // with the surface: for a hall of 100 x 60 x 15 m a table would take 2.9 GB.
  static constexpr int64_t kMostVoxels = int64_t{1} << 24;
  static bool Fits(const Eigen::Vector3i& size) {
    return size.cast<int64_t>().prod() <= kMostVoxels;
  }
  // Of the table of a box; 0 where it does not fit.
  static uint64_t Bytes(const Eigen::Vector3i& size) {
    return Fits(size) ? sizeof(uint32_t) * Entries(size) : 0;
  }

  // `rows` writes a layer's voxels along x, `words` of 64 bits for each y: bit `skip` + x of a row
  // is set where voxel x is opaque. It is called from any thread. `size` fits. CANCELLED when that
  // was requested on the way.
  using LayerRows = absl::FunctionRef<void(int z, std::span<uint64_t> rows)>;
  static absl::StatusOr<SummedVolumeTable> Create(const Eigen::Vector3i& size, size_t words,
                                                  size_t skip, LayerRows rows,
                                                  parallel::Parallel& parallel,
                                                  const parallel::Cancellation& cancelled = {});

  // Of the voxels low <= v < high, which lie in the box.
  uint32_t Count(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
    const auto x0 = static_cast<size_t>(low.x());
    const auto x1 = static_cast<size_t>(high.x());
    const size_t y0 = static_cast<size_t>(low.y()) * row_;
    const size_t y1 = static_cast<size_t>(high.y()) * row_;
    const uint32_t* bottom = sums_.get() + static_cast<size_t>(low.z()) * layer_;
    const uint32_t* top = sums_.get() + static_cast<size_t>(high.z()) * layer_;
    return (top[y1 + x1] - top[y1 + x0] - top[y0 + x1] + top[y0 + x0]) -
           (bottom[y1 + x1] - bottom[y1 + x0] - bottom[y0 + x1] + bottom[y0 + x0]);
  }

 private:
  explicit SummedVolumeTable(const Eigen::Vector3i& size);
  static size_t Entries(const Eigen::Vector3i& size) {
    return (size.cast<int64_t>().array() + 1).cast<size_t>().prod();
  }

  // An entry is the number of opaque voxels below it on all three axes.
  size_t row_ = 0;    // entries along x
  size_t layer_ = 0;  // along x and y
  std::unique_ptr<uint32_t[]> sums_;
};

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_SUMMED_VOLUME_TABLE_H_
