#include "core/planning/scoring/gain_cells.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace vantage::planning {
namespace {

// Of D: from here on a cell counts in part, so that rounding does not decide over its whole area.
constexpr float kAlmostThere = 0.99F;
constexpr size_t kCellsOfTask = 8192;

}  // namespace

CellArrays GainCells(const CellArrays& cells, const PatchSet& patches) {
  parallel::Serial serial;
  return GainCells(cells, patches, serial);
}

CellArrays GainCells(const CellArrays& cells, const PatchSet& patches,
                     parallel::Parallel& parallel) {
  CellArrays gains = cells;  // which shares all but these
  const std::span<float> q = gains.q.Mutable();
  const std::span<float> enough = gains.enough.Mutable();
  const std::span<float> factor = gains.factor.Mutable();
  parallel.For((gains.size() + kCellsOfTask - 1) / kCellsOfTask, [&](size_t task) {
    const size_t end = std::min(gains.size(), (task + 1) * kCellsOfTask);
    for (size_t i = task * kCellsOfTask; i < end; ++i) {
      const DeficientCell& cell = patches.cells[gains.cell[i]];
      // A scan is scored at the middle of a voxel and recorded at its worst corner, as in scores.
      const float there = cell.required * cell.spread;
      const bool has_it = cells.q[i] >= there;
      q[i] = kAlmostThere * there;
      enough[i] = there;
      factor[i] = has_it ? 0 : cell.success * cell.area / (there - q[i]);
    }
  });
  return gains;
}

double MostGainPerSample(const CellArrays& cells, const CellArrays& gains) {
  double most = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const float there = gains.enough[i];
    const float score = cells.factor[i] * (std::min(there, cells.enough[i]) - cells.q[i]);
    const float gain = gains.factor[i] * (there - gains.q[i]);
    if (score > 0) most = std::max(most, static_cast<double>(gain / score));
  }
  return most;
}

}  // namespace vantage::planning
