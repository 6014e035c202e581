// Patch cells in the order in which trees and samples want them (algorithm.md section 8).
#ifndef VANTAGE_CORE_PLANNING_SCORING_ORDERED_CELLS_H_
#define VANTAGE_CORE_PLANNING_SCORING_ORDERED_CELLS_H_

#include <cstdint>
#include <utility>

#include "absl/status/statusor.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

// Cells that lie close together and face the same way are neighbours: all cells are halved across
// what they differ in most, place or direction, then each half in turn, down to packets. A metre
// counts like a difference of 1 in a component of the normal. Padded.
class OrderedCells final : public CellArrays {
 public:
  OrderedCells() = default;  // no cells
  // CANCELLED when that was requested on the way.
  static absl::StatusOr<OrderedCells> Order(CellArrays cells, parallel::Parallel& parallel,
                                            const parallel::Cancellation& cancelled = {});

  // Where a range of `size` cells is halved: whole packets.
  static uint32_t LeftSize(uint32_t size);

 private:
  explicit OrderedCells(CellArrays cells) : CellArrays(std::move(cells)) {}
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_ORDERED_CELLS_H_
