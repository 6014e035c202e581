// Random samples of patch cells. What a view gains on a sample is an estimate of what it gains on
// all cells.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_CELL_SAMPLE_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_CELL_SAMPLE_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/planning/scoring/constraints.h"

namespace vantage::planning {

struct CellSample {
  CellArrays cells;
  std::vector<uint32_t> of;  // index of each sampled cell among all cells, ascending
};

// Draws cells with a probability proportional to the most that they can gain, stratified by place.
// Draws are independent and their range is known, so the bounds of MeanBounds hold for any scene
// (algorithm.md section 8, 'Race'). Keeps the reference.
class CellSampler {
 public:
  explicit CellSampler(const CellArrays& cells);

  // The most that a view can gain, samples.
  double potential() const { return potential_; }

  // Draws `draws` cells. Their factors are such that a cell scores its share of the most that it
  // can gain, [0, 1]; so the expected score of a view on the sample is draws * score / potential().
  // The same seed and round give the same sample.
  CellSample Draw(size_t draws, uint64_t seed, uint64_t round) const;

 private:
  // The most that a view can gain on a cell, samples.
  double MostOf(size_t i) const;
  // The first cell from `from` on that ends beyond a point of the line, else the last one.
  size_t CellAt(double point, size_t from) const;

  const CellArrays& cells_;
  double potential_ = 0;
  std::vector<double> line_;  // end of each packet on the line of potentials, samples
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_CELL_SAMPLE_H_
