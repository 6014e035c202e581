#include "core/visibility/summed_volume_table.h"

#include <algorithm>
#include <cstddef>
#include <span>

#include "absl/status/status.h"

namespace vantage::visibility {

absl::StatusOr<SummedVolumeTable> SummedVolumeTable::Create(
    const OpaqueGrid& grid, parallel::Parallel& parallel, const parallel::Cancellation& cancelled) {
  SummedVolumeTable table(grid);
  if (!table.Sum(grid, parallel, cancelled)) return absl::CancelledError("summed volume table");
  return table;
}

SummedVolumeTable::SummedVolumeTable(const OpaqueGrid& grid)
    : size_(grid.box().max - grid.box().min) {
  row_ = static_cast<size_t>(size_.x()) + 1;
  layer_ = row_ * (static_cast<size_t>(size_.y()) + 1);
  // Written below, layer by layer: to clear it all beforehand takes as long as all the rest.
  sums_ = std::make_unique_for_overwrite<uint32_t[]>(layer_ * static_cast<size_t>(size_.z() + 1));
  std::fill_n(sums_.get(), layer_, 0);
}

// False when cancelled on the way.
bool SummedVolumeTable::Sum(const OpaqueGrid& grid, parallel::Parallel& parallel,
                            const parallel::Cancellation& cancelled) {
  // Each layer by itself, then upwards.
  parallel.For(static_cast<size_t>(size_.z()), [&](size_t z) {
    if (cancelled.Requested()) return;
    uint32_t* layer = sums_.get() + (z + 1) * layer_;
    std::fill_n(layer, row_, 0);
    for (int y = 0; y < size_.y(); ++y) {
      const std::span<const uint64_t> bits =
          grid.Row(grid.box().min.y() + y, grid.box().min.z() + static_cast<int>(z));
      const uint32_t* before = layer + static_cast<size_t>(y) * row_;
      uint32_t* row = layer + static_cast<size_t>(y + 1) * row_;
      row[0] = 0;
      uint32_t sum = 0;
      for (size_t x = 0; x + 1 < row_; ++x) {
        sum += static_cast<uint32_t>((bits[x >> 6] >> (x & 63)) & 1);
        row[x + 1] = before[x + 1] + sum;
      }
    }
  });
  if (cancelled.Requested()) return false;
  parallel.For(static_cast<size_t>(size_.y()), [&](size_t y) {
    if (cancelled.Requested()) return;
    for (int z = 1; z <= size_.z(); ++z) {
      const uint32_t* below = sums_.get() + static_cast<size_t>(z - 1) * layer_ + (y + 1) * row_;
      uint32_t* row = sums_.get() + static_cast<size_t>(z) * layer_ + (y + 1) * row_;
      for (size_t x = 1; x < row_; ++x) row[x] += below[x];
    }
  });
  return !cancelled.Requested();
}

}  // namespace vantage::visibility
