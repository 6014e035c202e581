// Which stations to choose, as a problem of its own: what each candidate would bring, and which two
// of them could be aligned with each other (algorithm.md section 12).
#ifndef VANTAGE_CORE_COVER_COVER_PROBLEM_H_
#define VANTAGE_CORE_COVER_COVER_PROBLEM_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/cover/element_set.h"

namespace vantage::cover {

// Chosen stations hang together where each registers to what was there before, or to a station
// before it.
struct CoverProblem {
  std::vector<ElementSet> covers;  // by candidate: what it alone brings to the required density
  std::vector<double> weights;     // by element, m^2, above 0
  // By candidate, ascending: those that it could be aligned with. Symmetric.
  std::vector<std::vector<uint32_t>> links;
  // Candidates that register to what was there before. Empty where nothing was: then one station,
  // any of them, is the first, and all others hang together with it.
  std::vector<uint32_t> anchored;
  size_t candidates() const { return covers.size(); }
};

// Stations in an order in which each registers when its turn comes.
struct Cover {
  std::vector<uint32_t> stations;
  double weight = 0;  // m^2 that they cover
};

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_COVER_PROBLEM_H_
