#include "core/registration/levelling.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/floor_plane.h"
#include "core/registration/align/scan_surface.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

absl::StatusOr<Levelling> LevelFirstScan(const sensor::Scan& scan) {
  if (absl::Status status = scan.image.Validate(); !status.ok()) return status;
  constexpr double kMaxTilt = sensor::Radians(15);  // of a tripod set up by eye; ramps are flatter
  // m, of samples: 50 on the smallest floor, whose tilt a noise of 1 cm leaves to 0.4 degrees.
  constexpr double kSpacing = 0.10;
  // m, over the floor: surveyors' tripods reach 1.9 m, and the scanner 0.3 more.
  constexpr double kHighest = 2.2;
  Levelling result;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double over_floor = 0;  // m, where a floor was found
  if (scan.prior.has_value() && scan.prior->levelled_sigma.has_value()) {
    up = scan.prior->T_world_scan.linear().transpose() * Eigen::Vector3d::UnitZ();
    result.from_inclinometer = true;
  } else {
    parallel::Serial serial;
    const ScanSurface surface = SampleSurface(scan, kSpacing, serial);
    FloorPlane floor;
    result.found_floor = FindFloorPlane(surface.samples, kSpacing, kMaxTilt, floor);
    if (result.found_floor) {
      up = floor.normal;
      over_floor = -floor.height;
    }
  }
  // The smallest rotation that does it: the first scan keeps its heading.
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  result.T_world_scan.linear() = turn.toRotationMatrix();
  result.tilt = std::acos(std::clamp(up.normalized().z(), -1.0, 1.0));
  if (scan.prior.has_value() && scan.prior->trusted) return result;  // that pose stands
  if (!result.from_inclinometer && !result.found_floor) {
    result.message = absl::StrFormat(
        "no floor within %.0f degrees of level was seen and no inclinometer was given: the scanner "
        "is taken to have stood upright; if it was tilted or lay on its side, withdraw the scan "
        "and send it with a levelled pose prior",
        sensor::Degrees(kMaxTilt));
  } else if (over_floor > kHighest) {
    result.message = absl::StrFormat(
        "what was taken for the floor lies %.1f m below the scanner, farther than under any "
        "tripod: if the scanner lay on its side, that is a wall; withdraw the scan then, and send "
        "it with a levelled pose prior",
        over_floor);
  } else if (result.tilt > kMaxTilt) {
    result.message = absl::StrFormat(
        "the scanner was tilted by %.0f degrees: the scan is used as it is, but views are planned "
        "for a scanner that stands upright",
        sensor::Degrees(result.tilt));
  }
  return result;
}

}  // namespace vantage::registration
