#include "core/fleet/guarantee.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"

namespace vantage::fleet {

Guarantee GuaranteeOf(const GreedyRecord& record) {
  if (record.by_minutes) return {std::nullopt, "none: views were ranked by score per minute"};
  if (record.waits) {
    return {std::nullopt, "none: a view registers only after another's scan is in"};
  }
  if (record.crowded) {
    return {std::nullopt, "none: a view was left out because it lies too near to a chosen one"};
  }
  if (record.unchecked) {
    return {std::nullopt,
            "none: as many views were checked as may be, and not every scanner has one"};
  }
  if (record.cut_short) {
    return {std::nullopt, "none: the budget ended before every scanner was decided on"};
  }
  const double a = std::clamp(record.exactness, 0.0, 1.0);
  const auto k = static_cast<double>(std::max<size_t>(1, record.scanners));
  const char* const how = a >= 1 ? "every choice was the best there was"
                                 : "by the bounds of the views that were not scored exactly";
  if (record.alike) {
    const double share = 1 - std::pow(1 - a / k, k);
    return {share,
            absl::StrFormat("greedy choice for %d like scanners: at least %.0f %% of the best; %s",
                            static_cast<int>(k), share * 100, how)};
  }
  const double share = a / (1 + a);
  return {share,
          absl::StrFormat("greedy choice for %d scanners that differ, or can go to different "
                          "places: at least %.0f %% of the best; %s",
                          static_cast<int>(k), share * 100, how)};
}

}  // namespace vantage::fleet
