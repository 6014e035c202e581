#include "core/planning/evaluation/cell_sample.h"

#include <algorithm>
#include <utility>

#include "core/planning/evaluation/confidence_bounds.h"

namespace vantage::planning {

CellSampler::CellSampler(const CellArrays& cells) : cells_(cells) {
  line_.reserve(cells.packets());
  for (size_t i = 0; i < cells.size(); ++i) {
    potential_ += MostOf(i);
    if ((i + 1) % CellArrays::kPacket == 0) line_.push_back(potential_);
  }
  if (cells.size() % CellArrays::kPacket != 0) line_.push_back(potential_);
}

double CellSampler::MostOf(size_t i) const {
  return static_cast<double>(cells_.factor[i] * (cells_.enough[i] - cells_.q[i]));
}

size_t CellSampler::CellAt(double point, size_t from) const {
  // Draws may lie far apart, so the next packet is found by bisection.
  const auto packet = std::upper_bound(
      line_.begin() + static_cast<ptrdiff_t>(from / CellArrays::kPacket), line_.end(), point);
  if (packet == line_.end()) return cells_.size() - 1;
  size_t at = static_cast<size_t>(packet - line_.begin()) * CellArrays::kPacket;
  double end = packet == line_.begin() ? 0 : *(packet - 1);
  // The same sums as above, to the bit.
  for (;; ++at) {
    end += MostOf(at);
    if (end > point && at >= from) return at;
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
    at = CellAt(point, at);
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
