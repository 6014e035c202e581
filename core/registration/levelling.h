// Levelling the first scan, for which there is no model to align to.
#ifndef VANTAGE_CORE_REGISTRATION_LEVELLING_H_
#define VANTAGE_CORE_REGISTRATION_LEVELLING_H_

#include <Eigen/Geometry>
#include <string>

#include "absl/status/statusor.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// Levels the first scan of a session: the rotation that turns its floor's normal to +z, found from
// the largest upward-facing horizontal plane within 15 degrees of level (or from the prior's
// inclinometer, which then stands). Identity rotation where there is no floor to see.
struct Levelling {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double tilt = 0;  // rad, that was taken out
  bool from_inclinometer = false;
  bool found_floor = false;
  // What was assumed of the tilt, and what to do if that is wrong; empty where it was measured and
  // the scanner stood upright.
  std::string message;
};
absl::StatusOr<Levelling> LevelFirstScan(const sensor::Scan& scan);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_LEVELLING_H_
