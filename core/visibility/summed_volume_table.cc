#include "core/visibility/summed_volume_table.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace vantage::visibility {

SummedVolumeTable::SummedVolumeTable(const Eigen::Vector3i& size)
    : row_(static_cast<size_t>(size.x()) + 1),
      layer_(row_ * (static_cast<size_t>(size.y()) + 1)),
      // Written layer by layer in Create(): to clear it all beforehand takes as long as the rest.
      sums_(std::make_unique_for_overwrite<uint32_t[]>(Entries(size))) {}

absl::StatusOr<SummedVolumeTable> SummedVolumeTable::Create(
    const Eigen::Vector3i& size, size_t words, size_t skip, LayerRows rows,
    parallel::Parallel& parallel, const parallel::Cancellation& cancelled) {
  SummedVolumeTable table(size);
  const size_t row = table.row_;
  const size_t layer = table.layer_;
  uint32_t* const sums = table.sums_.get();
  const auto height = static_cast<size_t>(size.y());
  // Each layer by itself, then upwards.
  std::fill_n(sums, layer, 0);
  parallel.For(static_cast<size_t>(size.z()), [&](size_t z) {
    if (cancelled.Requested()) return;
    std::vector<uint64_t> bits(words * height);
    rows(static_cast<int>(z), bits);
    uint32_t* before = sums + (z + 1) * layer;
    std::fill_n(before, row, 0);
    for (size_t y = 0; y < height; ++y) {
      uint32_t* const here = before + row;
      here[0] = 0;
      uint32_t sum = 0;
      for (size_t x = 0; x + 1 < row; ++x) {
        const size_t bit = skip + x;
        sum += static_cast<uint32_t>(bits[y * words + (bit >> 6)] >> (bit & 63) & 1);
        here[x + 1] = before[x + 1] + sum;
      }
      before = here;
    }
  });
  if (cancelled.Requested()) return absl::CancelledError("summed volume table");
  parallel.For(height, [&](size_t y) {
    if (cancelled.Requested()) return;
    for (size_t z = 1; z <= static_cast<size_t>(size.z()); ++z) {
      const uint32_t* const below = sums + (z - 1) * layer + (y + 1) * row;
      uint32_t* const here = sums + z * layer + (y + 1) * row;
      for (size_t x = 1; x < row; ++x) here[x] += below[x];
    }
  });
  if (cancelled.Requested()) return absl::CancelledError("summed volume table");
  return table;
}

}  // namespace vantage::visibility
