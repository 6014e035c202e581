#include "core/planning/ranking/gain_bounds.h"

#include <algorithm>

namespace vantage::planning {
double LargestGainWithoutHidden(std::span<const RankedView> views) {
  double most = 0;
  for (const RankedView& view : views) most = std::max(most, view.gain_without_hidden.value_or(0));
  return most;
}

double LargestModelGain(std::span<const RankedView> views) {
  double most = 0;
  for (const RankedView& view : views) most = std::max(most, view.model_gain.value_or(0));
  return most;
}

}  // namespace vantage::planning
