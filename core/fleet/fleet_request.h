// The request of a joint plan.
#ifndef VANTAGE_CORE_FLEET_FLEET_REQUEST_H_
#define VANTAGE_CORE_FLEET_FLEET_REQUEST_H_

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "core/fleet/fleet_member.h"
#include "core/planning/expectation/expected_site.h"
#include "core/sensor/scanner_model.h"

namespace vantage::fleet {

// A view that is claimed: a scan from there is expected.
struct PledgedView {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame
  sensor::ScannerModel model;
  std::optional<double> heading = {};  // rad, of a scanner that sees a sector; absent: all around
};

enum class FleetRanking {
  kScore,
  kScorePerMinute,  // per minute of walking, setting up, scanning and waiting for others
};

struct FleetRequest {
  std::vector<FleetMember> scanners;  // at least one
  std::vector<PledgedView> pledged;   // these count as scanned
  FleetRanking ranking = FleetRanking::kScore;
  // What a prior of the site shows, as planning::PlanningQuestion has it; null: there is none.
  std::shared_ptr<const planning::ExpectedSite> site = nullptr;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_FLEET_REQUEST_H_
