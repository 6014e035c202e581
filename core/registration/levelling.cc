#include "core/registration/levelling.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/floor_plane.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/wall_normals.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

namespace {

constexpr double kMaxTilt = sensor::Radians(15);  // of a tripod set up by eye; ramps are flatter
// m, of samples: 50 on the smallest floor, whose tilt a noise of 1 cm leaves to 0.4 degrees.
constexpr double kSpacing = 0.10;

// rad: how far from upright, as the prior has it, a floor is looked for: three sigmas of the
// prior's tilt, and not less than floors fall.
double FarthestTilt(const std::optional<sensor::PosePrior>& prior) {
  constexpr double kFloorsFall = sensor::Radians(1.5);
  if (!prior.has_value() || !prior->covariance.has_value()) return kMaxTilt;
  const double variance = prior->covariance->topLeftCorner<2, 2>().trace();
  return std::clamp(3 * std::sqrt(variance), kFloorsFall, kMaxTilt);
}

// What the scan shows of which way is up.
struct SeenUp {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // unit, in the frame of the samples
  bool floor = false;
  bool walls = false;      // decided, since they tell and the floor does not
  double over_floor = 0;   // m
  double floor_slope = 0;  // rad, where walls decided although there is a floor
};

// `samples` are level to within `max_tilt` rad.
SeenUp FindUp(const std::vector<SurfaceSample>& samples, double max_tilt) {
  // rad, and of the floor's misfit: floors fall by a degree, and walls are half a degree from
  // vertical; a misfit that halves is not noise, which is in both.
  constexpr double kSlope = sensor::Radians(2);
  constexpr double kBetter = 0.5;
  // rad, in the mean: the normals of walls, with their noise; above it what is steep is no walls.
  constexpr double kWalls = sensor::Radians(4);
  SeenUp seen;
  FloorPlane floor;
  seen.floor = FindFloorPlane(samples, kSpacing, max_tilt, floor);
  if (seen.floor) {
    seen.up = floor.normal;
    seen.over_floor = -floor.height;
  }
  const WallNormals walls(samples, kSpacing, max_tilt);
  if (!walls.TellUp()) return seen;
  const Eigen::Vector3d up = walls.Up(seen.up);
  if (std::acos(std::clamp(up.z(), -1.0, 1.0)) > max_tilt || walls.Misfit(up) > kWalls) return seen;
  const double off = std::acos(std::clamp(up.dot(seen.up), -1.0, 1.0));
  if (seen.floor && (off < kSlope || walls.Misfit(up) > kBetter * walls.Misfit(seen.up))) {
    return seen;
  }
  seen.walls = true;
  if (seen.floor) seen.floor_slope = off;
  seen.up = up;
  return seen;
}

}  // namespace

absl::StatusOr<Levelling> LevelFirstScan(const sensor::Scan& scan) {
  if (absl::Status status = scan.image.Validate(); !status.ok()) return status;
  // m, over the floor: surveyors' tripods reach 1.9 m, and the scanner 0.3 more.
  constexpr double kHighest = 2.2;
  Levelling result;
  // Upright as the prior has it, scanner frame.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  if (scan.prior.has_value()) {
    up = scan.prior->T_world_scan.linear().transpose() * Eigen::Vector3d::UnitZ();
  }
  const double max_tilt = FarthestTilt(scan.prior);
  SeenUp seen;
  if (scan.prior.has_value() && scan.prior->levelled_sigma.has_value()) {
    result.from_inclinometer = true;
  } else {
    parallel::Serial serial;
    std::vector<SurfaceSample> samples = SampleSurface(scan, kSpacing, serial).samples;
    const Eigen::Matrix3d stated =
        Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Matrix3f turn = stated.cast<float>();
    for (SurfaceSample& s : samples) {
      s.point = turn * s.point;
      s.normal = turn * s.normal;
    }
    seen = FindUp(samples, max_tilt);
    result.found_floor = seen.floor;
    up = stated.transpose() * seen.up;
  }
  // The smallest rotation that does it: the first scan keeps its heading.
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  result.T_world_scan.linear() = turn.toRotationMatrix();
  result.tilt = std::acos(std::clamp(up.normalized().z(), -1.0, 1.0));
  if (scan.prior.has_value() && scan.prior->trusted) return result;  // that pose stands
  if (seen.walls && seen.floor) {
    result.message = absl::StrFormat(
        "the walls say that the floor slopes by %.0f degrees: the scan is levelled by its walls; "
        "if they are not vertical, withdraw the scan and send it with a levelled pose prior",
        sensor::Degrees(seen.floor_slope));
  } else if (seen.walls) {
    result.message =
        "no floor was seen and no inclinometer was given: the scan is levelled by its walls; if "
        "they are not vertical, withdraw it and send it with a levelled pose prior";
  } else if (!result.from_inclinometer && !result.found_floor) {
    result.message = absl::StrFormat(
        "no floor within %.3g degrees of %s was seen and no inclinometer was given: the scanner is "
        "taken to have stood %s; if it was tilted or lay on its side, withdraw the scan and send "
        "it with a levelled pose prior",
        sensor::Degrees(max_tilt), scan.prior.has_value() ? "its pose prior" : "level",
        scan.prior.has_value() ? "as its pose prior says" : "upright");
  } else if (seen.over_floor > kHighest) {
    result.message = absl::StrFormat(
        "what was taken for the floor lies %.1f m below the scanner, farther than under any "
        "tripod: if the scanner lay on its side, that is a wall; withdraw the scan then, and send "
        "it with a levelled pose prior",
        seen.over_floor);
  } else if (result.tilt > kMaxTilt) {
    result.message = absl::StrFormat(
        "the scanner was tilted by %.0f degrees: the scan is used as it is, but views are planned "
        "for a scanner that stands upright",
        sensor::Degrees(result.tilt));
  }
  return result;
}

}  // namespace vantage::registration
