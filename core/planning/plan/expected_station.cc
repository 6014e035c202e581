#include "core/planning/plan/expected_station.h"

#include "absl/strings/str_format.h"

namespace vantage::planning {

std::string ExpectedStationWords(const ExpectedStation& expected, const Eigen::Vector3d& origin) {
  if (expected.by_site_prior) {
    return absl::StrFormat(
        "the prior of the site shows it; floor and clearance were not seen yet; any free spot "
        "within %.1f m is as good",
        expected.radius);
  }
  if (!expected.doorway.has_value()) {
    return absl::StrFormat(
        "that floor, way and clearance are free was not all seen; any free spot within %.1f m is "
        "as good",
        expected.radius);
  }
  const Eigen::Vector3d doorway = *expected.doorway + origin;
  return absl::StrFormat(
      "inside the room behind the doorway at (%.2f, %.2f); floor and clearance were not seen yet; "
      "any free spot of the room within %.1f m is as good",
      doorway.x(), doorway.y(), expected.radius);
}

}  // namespace vantage::planning
