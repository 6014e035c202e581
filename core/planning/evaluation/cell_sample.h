// Random draws of patch cells: what a sample of them gains stands for what all gain.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_CELL_SAMPLE_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_CELL_SAMPLE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

struct CellSample {
  CellArrays cells;
  std::vector<uint32_t> of;  // which of all cells each is, ascending
};

// Draws lie along a line on which each cell is as long as the most it can gain, one at random in
// each of n equal parts: strata are places (neighbours lie side by side), the probability is
// proportional to area x deficit x weight, and the draws are independent with a known range, so the
// bounds of MeanBounds hold for any scene. Keeps the reference.
class CellSampler {
 public:
  explicit CellSampler(const CellArrays& cells);

  // The most that a view can gain, samples.
  double potential() const { return potential_; }

  // `draws` cells, each with a factor of which the score is its share of what the cell can gain, so
  // that the expected score of a sample is draws * score / potential(). The same for the same seed
  // and round.
  CellSample Draw(size_t draws, uint64_t seed, uint64_t round) const;

 private:
  const CellArrays& cells_;
  double potential_ = 0;
  std::vector<double> line_;  // where each cell ends
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_CELL_SAMPLE_H_
