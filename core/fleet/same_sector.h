// Whether a scan shows what a view was to show, where the scanner sees a sector (algorithm.md
// section 11).
#ifndef VANTAGE_CORE_FLEET_SAME_SECTOR_H_
#define VANTAGE_CORE_FLEET_SAME_SECTOR_H_

#include <cmath>
#include <numbers>
#include <optional>

namespace vantage::fleet {

// True when a scan that faces `made` shows three quarters or more of the sector of `span` that
// faces `meant` (all in rad). Without a heading of either nothing speaks against it.
inline bool ShowsSameSector(std::optional<double> meant, std::optional<double> made, double span) {
  if (!meant.has_value() || !made.has_value()) return true;
  const double turned = std::remainder(*made - *meant, 2 * std::numbers::pi);
  return std::abs(turned) <= span / 4;
}

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_SAME_SECTOR_H_
