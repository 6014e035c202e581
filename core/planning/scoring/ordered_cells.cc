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

// Halves all of it, down to packets.
void HalveDown(std::span<Keyed> cells) {
  if (cells.size() <= OrderedCells::kPacket) return;
  Halve(cells);
  const uint32_t left = OrderedCells::LeftSize(static_cast<uint32_t>(cells.size()));
  HalveDown(cells.first(left));
  HalveDown(cells.subspan(left));
}

// Cells that are halved by one thread: their keys (230 kB) stay in its cache, and a flat's cells
// still make several such ranges.
constexpr size_t kOfOneThread = 1 << 13;

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
  // Level by level, the ranges of a level in parallel; then what is left of each range.
  std::vector<std::span<Keyed>> level = {keyed};
  std::vector<std::span<Keyed>> next;
  std::vector<std::span<Keyed>> small;
  while (true) {
    next.clear();
    for (const std::span<Keyed> range : level) {
      (range.size() > kOfOneThread ? next : small).push_back(range);
    }
    if (next.empty()) break;
    parallel.For(next.size(), [&](size_t i) {
      if (!cancelled.Requested()) Halve(next[i]);
    });
    if (cancelled.Requested()) return absl::CancelledError("order cells");
    level.clear();
    for (const std::span<Keyed> range : next) {
      const uint32_t left = LeftSize(static_cast<uint32_t>(range.size()));
      level.push_back(range.first(left));
      level.push_back(range.subspan(left));
    }
  }
  parallel.For(small.size(), [&](size_t i) {
    if (!cancelled.Requested()) HalveDown(small[i]);
  });
  if (cancelled.Requested()) return absl::CancelledError("order cells");
  std::vector<uint32_t> order(cells.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = keyed[i].cell;
  std::vector<Keyed>().swap(keyed);  // no longer needed
  cells.Pick(order);
  return OrderedCells(std::move(cells));
}

}  // namespace vantage::planning
