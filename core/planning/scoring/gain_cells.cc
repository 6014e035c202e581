#include "core/planning/scoring/gain_cells.h"

#include <algorithm>
#include <cstddef>

namespace vantage::planning {
namespace {

// Of D: from here on a cell counts in part, so that rounding does not decide over its whole area.
constexpr float kAlmostThere = 0.99F;

}  // namespace

CellArrays GainCells(const CellArrays& cells, const PatchSet& patches) {
  CellArrays gains = cells;
  for (size_t i = 0; i < gains.size(); ++i) {
    const DeficientCell& cell = patches.cells[gains.cell[i]];
    // A scan is scored at the middle of a voxel and recorded at its worst corner, as in scores.
    const float there = cell.required * cell.spread;
    const bool has_it = cells.q[i] >= there;
    gains.q[i] = kAlmostThere * there;
    gains.enough[i] = there;
    gains.factor[i] = has_it ? 0 : cell.success * cell.area / (there - gains.q[i]);
  }
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
