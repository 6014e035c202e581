#include "core/planning/scoring/ordered_cells.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"

namespace vantage::planning {
namespace {

struct Keyed {
  std::array<float, 6> key;  // position (m), normal
  uint32_t cell;
};

void Halve(std::span<Keyed> cells) {
  std::array<float, 6> low = cells.front().key;
  std::array<float, 6> high = low;
  for (const Keyed& cell : cells) {
    for (size_t a = 0; a < 6; ++a) {
      low[a] = std::min(low[a], cell.key[a]);
      high[a] = std::max(high[a], cell.key[a]);
    }
  }
  size_t axis = 0;
  for (size_t a = 1; a < 6; ++a) {
    if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
  }
  const auto middle = cells.begin() + OrderedCells::LeftSize(static_cast<uint32_t>(cells.size()));
  std::nth_element(cells.begin(), middle, cells.end(), [axis](const Keyed& a, const Keyed& b) {
    return a.key[axis] != b.key[axis] ? a.key[axis] < b.key[axis] : a.cell < b.cell;
  });
}

}  // namespace

uint32_t OrderedCells::LeftSize(uint32_t size) {
  constexpr auto kPacketSize = static_cast<uint32_t>(kPacket);
  const uint32_t packets = (size + kPacketSize - 1) / kPacketSize;
  return packets / 2 * kPacketSize;
}

absl::StatusOr<OrderedCells> OrderedCells::Order(CellArrays cells, parallel::Parallel& parallel,
                                                 const parallel::Cancellation& cancelled) {
  std::vector<Keyed> keyed(cells.size());
  for (uint32_t i = 0; i < cells.size(); ++i) {
    keyed[i] = {{cells.x[i], cells.y[i], cells.z[i], cells.nx[i], cells.ny[i], cells.nz[i]}, i};
  }
  // Level by level, the ranges of a level in parallel.
  std::vector<std::span<Keyed>> level = {keyed};
  std::vector<std::span<Keyed>> next;
  while (!level.empty()) {
    std::erase_if(level, [](std::span<Keyed> range) { return range.size() <= kPacket; });
    parallel.For(level.size(), [&](size_t i) {
      if (!cancelled.Requested()) Halve(level[i]);
    });
    if (cancelled.Requested()) return absl::CancelledError("order cells");
    next.clear();
    for (const std::span<Keyed> range : level) {
      const uint32_t left = LeftSize(static_cast<uint32_t>(range.size()));
      next.push_back(range.first(left));
      next.push_back(range.subspan(left));
    }
    level.swap(next);
  }
  std::vector<uint32_t> order(cells.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = keyed[i].cell;
  std::vector<Keyed>().swap(keyed);  // no longer needed
  cells.Pick(order);
  return OrderedCells(std::move(cells));
}

}  // namespace vantage::planning
