#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

absl::StatusOr<OpaqueGrid> OpaqueGrid::Create(const model::PlanningView& model,
                                              const parallel::Cancellation& cancelled) {
  auto rows = OpaqueRows::Create(model, {0, 1, 2}, cancelled);
  if (!rows.ok()) return rows.status();
  return OpaqueGrid(*std::move(rows));
}

bool OpaqueGrid::AllOpaque(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
  if (low.x() >= high.x()) return true;
  const auto first = static_cast<size_t>(low.x()) >> 6;
  const auto last = static_cast<size_t>(high.x() - 1) >> 6;
  const uint64_t from = ~uint64_t{0} << (low.x() & 63);
  const uint64_t until = ~uint64_t{0} >> (63 - ((high.x() - 1) & 63));
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      const std::span<const uint64_t> row = rows_.RowFromCorner(y, z);
      for (size_t word = first; word <= last; ++word) {
        uint64_t wanted = ~uint64_t{0};
        if (word == first) wanted &= from;
        if (word == last) wanted &= until;
        if ((row[word] & wanted) != wanted) return false;
      }
    }
  }
  return true;
}

}  // namespace vantage::visibility
