#include "server/session/sightings.h"

#include <string>
#include <utility>

#include "core/registration/sightings.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

std::vector<registration::Sighting> SightingsIn(const v1::Scan& scan,
                                                const Eigen::Vector3d& origin) {
  std::vector<registration::Sighting> out;
  for (const v1::TargetSighting& target : scan.targets()) {
    registration::Sighting sighting;
    sighting.name = target.name();
    sighting.in_scan = conversion::ReadOwnVector(target.in_scan());
    if (target.has_sigma_m()) sighting.sigma = target.sigma_m();
    if (target.has_in_world()) {
      sighting.in_world = conversion::ReadOwnVector(target.in_world()) - origin;
    }
    out.push_back(std::move(sighting));
  }
  return out;
}

// What each scan in the model saw, but for one.
std::vector<registration::SightingsOfScan> SightingsInModel(const SessionState& state,
                                                            const std::string& but,
                                                            const Eigen::Vector3d& origin) {
  std::vector<registration::SightingsOfScan> before;
  for (const std::string& name : state.scan_order) {
    const ScanRecord& record = state.scans.at(name);
    if (!record.in_model || name == but || record.scan.targets().empty()) continue;
    before.push_back({conversion::ReadOwnPose(record.scan.pose(), origin),
                      record.scan.registration().verdict().error_bound_m(),
                      SightingsIn(record.scan, origin)});
  }
  return before;
}

}  // namespace

std::vector<registration::TargetTie> TiesOf(const SessionState& state, const v1::Scan& scan,
                                            const Eigen::Vector3d& origin) {
  if (scan.targets().empty()) return {};
  const std::vector<registration::SightingsOfScan> before =
      SightingsInModel(state, scan.name(), origin);
  return registration::TiesOf(SightingsIn(scan, origin), before);
}

std::vector<registration::KnownTarget> KnownTargetsOf(const SessionState& state,
                                                      const Eigen::Vector3d& origin) {
  return registration::KnownTargetsOf(SightingsInModel(state, "", origin));
}

std::vector<planning::ScannedFrom> ScannedFromOf(const SessionState& state,
                                                 const Eigen::Vector3d& origin) {
  std::vector<planning::ScannedFrom> scans;
  for (const std::string& name : state.scan_order) {
    const ScanRecord& record = state.scans.at(name);
    if (!record.in_model) continue;
    scans.push_back({name, conversion::ReadOwnPose(record.scan.pose(), origin).translation(),
                     record.scan.registration().verdict().error_bound_m()});
  }
  return scans;
}

}  // namespace vantage::session
