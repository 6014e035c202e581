// The members of a fleet.
#ifndef VANTAGE_CORE_FLEET_FLEET_MEMBER_H_
#define VANTAGE_CORE_FLEET_FLEET_MEMBER_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::fleet {

// A scanner and the person who carries it.
struct FleetMember {
  sensor::ScannerModel model;
  std::optional<Eigen::Vector3d> at;    // m, where it stands; absent: at the model's last station
  std::vector<planning::Region> reach;  // where it may stand and walk; none: everywhere
  double speed = 1;                     // m/s, > 0
  double scan_seconds = 180;            // to set up and scan
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_FLEET_MEMBER_H_
