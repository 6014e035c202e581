#include "core/planning/evaluation/cell_sample.h"

#include <algorithm>
#include <utility>

#include "core/planning/evaluation/confidence_bounds.h"

namespace vantage::planning {

CellSampler::CellSampler(const CellArrays& cells) : cells_(cells) {
  line_.reserve(cells.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    potential_ += static_cast<double>(cells.factor[i] * (cells.enough[i] - cells.q[i]));
    line_.push_back(potential_);
  }
}

CellSample CellSampler::Draw(size_t draws, uint64_t seed, uint64_t round) const {
  std::vector<uint32_t> indices;
  std::vector<float> factors;
  indices.reserve(draws);
  factors.reserve(draws);
  const double part = potential_ / static_cast<double>(draws);
  size_t at = 0;
  for (size_t k = 0; k < draws; ++k) {
    const double point = (static_cast<double>(k) + HashToUnit(seed, round, k)) * part;
    // Draws may lie far apart, so the next cell is found by bisection.
    at = static_cast<size_t>(
        std::upper_bound(line_.begin() + static_cast<ptrdiff_t>(at), line_.end(), point) -
        line_.begin());
    at = std::min(at, line_.size() - 1);
    const float unit = 1 / (cells_.enough[at] - cells_.q[at]);
    if (!indices.empty() && indices.back() == at) {
      factors.back() += unit;
    } else {
      indices.push_back(static_cast<uint32_t>(at));
      factors.push_back(unit);
    }
  }
  CellSample sample;
  sample.cells = cells_.Gather(indices, factors);
  sample.of = std::move(indices);
  return sample;
}

}  // namespace vantage::planning
