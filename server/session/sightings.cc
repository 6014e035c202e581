#include "server/session/sightings.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/container/flat_hash_map.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

// m, one sigma of a scan's place: the first scan defines the world frame.
double PoseSigma(const v1::Scan& scan) {
  constexpr double kSigmasOfBound = 1.96;  // the bound holds at 95 %
  return scan.registration().verdict().error_bound_m() / kSigmasOfBound;
}

struct Known {
  Eigen::Vector3d place;
  double sigma;  // m, in addition to that of the sighting
};

}  // namespace

std::vector<registration::TargetTie> TiesOf(const SessionState& state, const v1::Scan& scan,
                                            const Eigen::Vector3d& origin) {
  std::vector<registration::TargetTie> ties;
  if (scan.targets().empty()) return ties;
  absl::flat_hash_map<std::string, Known> known;
  for (const std::string& name : state.scan_order) {
    const ScanRecord& record = state.scans.at(name);
    if (!record.in_model || name == scan.name() || record.scan.targets().empty()) continue;
    const Eigen::Isometry3d pose = conversion::ReadOwnPose(record.scan.pose(), origin);
    for (const v1::TargetSighting& sighting : record.scan.targets()) {
      const Known here{pose * conversion::ReadOwnVector(sighting.in_scan()),
                       PoseSigma(record.scan)};
      const auto [it, fresh] = known.try_emplace(sighting.name(), here);
      if (!fresh && here.sigma < it->second.sigma) it->second = here;
    }
  }
  for (const v1::TargetSighting& sighting : scan.targets()) {
    registration::TargetTie tie;
    tie.name = sighting.name();
    tie.in_scan = conversion::ReadOwnVector(sighting.in_scan());
    if (sighting.has_sigma_m()) tie.sigma = sighting.sigma_m();
    if (sighting.has_in_world()) {
      tie.in_world = conversion::ReadOwnVector(sighting.in_world()) - origin;
    } else if (const auto it = known.find(tie.name); it != known.end()) {
      tie.in_world = it->second.place;
      tie.sigma = std::min(1.0, std::hypot(tie.sigma, it->second.sigma));
    } else {
      continue;
    }
    ties.push_back(std::move(tie));
  }
  return ties;
}

}  // namespace vantage::session
