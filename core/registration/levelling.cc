#include "core/registration/levelling.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/floor_plane.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/sideways_floor.h"
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

// Whether a prior says how the scanner was tilted: an upright one may just not speak of it, as
// those do that tell a place alone.
bool StatesTilt(const sensor::PosePrior& prior) {
  const double up = prior.T_world_scan.linear()(2, 2);
  return prior.trusted || prior.covariance.has_value() ||
         std::acos(std::clamp(up, -1.0, 1.0)) > kMaxTilt;
}

// What the scan shows of which way is up.
struct SeenUp {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // unit, in the frame of the samples
  bool floor = false;
  bool walls = false;      // decided, since they tell and the floor does not
  FloorPlane plane;        // the floor, where there is one, in the frame of the samples
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
  seen.floor = FindFloorPlane(samples, kSpacing, max_tilt, seen.plane);
  if (seen.floor) seen.up = seen.plane.normal;
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
  std::optional<SidewaysFloor> sideways;
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
    if (seen.floor && !(scan.prior.has_value() && StatesTilt(*scan.prior))) {
      const Eigen::Matrix3f back = turn.transpose();
      for (SurfaceSample& s : samples) {
        s.point = back * s.point;
        s.normal = back * s.normal;
      }
      FloorPlane floor = seen.plane;
      floor.normal = stated.transpose() * floor.normal;
      sideways = FindSidewaysFloor(samples, scan.image, kSpacing, floor);
      result.maybe_on_side = sideways.has_value();
    }
    up = stated.transpose() * seen.up;
  }
  // The smallest rotation that does it: the first scan keeps its heading.
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  result.T_world_scan.linear() = turn.toRotationMatrix();
  result.tilt = std::acos(std::clamp(up.normalized().z(), -1.0, 1.0));
  if (scan.prior.has_value() && scan.prior->trusted) return result;  // that pose stands
  if (sideways.has_value() && -seen.plane.height <= kHighest) {
    result.message = absl::StrFormat(
        "what was taken for the floor, %.1f m below the scanner, may be a wall: at right angles to "
        "it lies a plane, %.1f m away, that fits better as the floor, since it and what lies "
        "opposite have %.0f m2 to %.0f m2; the scanner is taken to have stood upright; if it lay "
        "on its side, withdraw the scan and send one from an upright scanner, or this one with a "
        "levelled pose prior",
        -seen.plane.height, sideways->distance, sideways->area, sideways->level_area);
  } else if (seen.walls && seen.floor) {
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
  } else if (-seen.plane.height > kHighest) {
    result.message = absl::StrFormat(
        "what was taken for the floor lies %.1f m below the scanner, farther than under any "
        "tripod: if the scanner lay on its side, that is a wall; withdraw the scan then, and send "
        "it with a levelled pose prior",
        -seen.plane.height);
  } else if (result.tilt > kMaxTilt) {
    result.message = absl::StrFormat(
        "the scanner was tilted by %.0f degrees: the scan is used as it is, but views are planned "
        "for a scanner that stands upright",
        sensor::Degrees(result.tilt));
  }
  return result;
}

std::string TiltInDoubt(const sensor::Scan& scan) {
  if (scan.prior.has_value() && StatesTilt(*scan.prior)) return "";
  const absl::StatusOr<Levelling> level = LevelFirstScan(scan);
  if (!level.ok() || level->from_inclinometer) return "";
  if (level->maybe_on_side) {
    return "by what it saw the scanner may have lain on its side: scan from an upright scanner, or "
           "send this scan with a levelled pose prior";
  }
  if (!level->found_floor) {
    return absl::StrFormat(
        "no floor within %.3g degrees of level was seen: if the scanner was tilted farther, scan "
        "from an upright scanner, or send this scan with a levelled pose prior",
        sensor::Degrees(kMaxTilt));
  }
  return "";
}

}  // namespace vantage::registration
