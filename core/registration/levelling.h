// Levelling the first scan, for which there is no model to align to.
#ifndef VANTAGE_CORE_REGISTRATION_LEVELLING_H_
#define VANTAGE_CORE_REGISTRATION_LEVELLING_H_

#include <Eigen/Geometry>
#include <string>

#include "absl/status/statusor.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// Levels the first scan of a session: the rotation that turns up to +z. Up is what the prior's
// inclinometer says, which then stands; or the normal of the floor, the largest upward-facing plane
// within 15 degrees of upright as the prior has it (nearer, where the prior's covariance says so),
// unless the walls say that the floor slopes (FindFloorPlane(), WallNormals); or what the walls
// say; or the prior's. Identity rotation where nothing tells.
struct Levelling {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double tilt = 0;  // rad, that was taken out
  bool from_inclinometer = false;
  bool found_floor = false;
  // Neither inclinometer nor prior says how the scanner stood, and what was seen fits a scanner on
  // its side better (FindSidewaysFloor()). It is taken to have stood upright all the same.
  bool maybe_on_side = false;
  // What was assumed of the tilt, and what to do if that is wrong; empty where inclinometer or
  // floor told it and the scanner stood upright.
  std::string message;
};
absl::StatusOr<Levelling> LevelFirstScan(const sensor::Scan& scan);

// Of any scan that did not register: that this may be since the scanner was on its side or tilted
// farther than its floor tells, and what to do then. Empty where it stood upright by what it saw,
// or where its inclinometer or a trusted prior says how it stood.
std::string TiltInDoubt(const sensor::Scan& scan);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_LEVELLING_H_
