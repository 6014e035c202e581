// What the best view gains, without what is hidden (algorithm.md section 10).
#ifndef VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_
#define VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_

#include <cstdint>
#include <span>

#include "core/planning/plan/ranked_view.h"

namespace vantage::planning {

// What the best feasible view gains, as in all of this file its model gain and the gain of what is
// expected (RankedView::gain_without_hidden), lies between `lower` and `upper`, m2.
struct GainBounds {
  // Both with the plan's confidence; where a view was summed exactly, `lower` is what it gains.
  double lower = 0;
  double upper = 0;
  // Some view has so much model gain, m2. No view has more model gain than `upper`: gain without
  // what is hidden is model gain and more.
  double model_gain = 0;
  uint64_t rays = 0;  // that it took to find out
};

// The largest gain without what is hidden, and model gain, among views of which they are known, m2;
// 0 when there is none.
double LargestGainWithoutHidden(std::span<const RankedView> views);
double LargestModelGain(std::span<const RankedView> views);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_GAIN_BOUNDS_H_
