#include "server/session/pledged_views.h"

#include "server/conversion/fleet_proto.h"

namespace vantage::session {

std::vector<fleet::PledgedView> ClaimedViews(const SessionState& state,
                                             const Eigen::Vector3d& origin) {
  std::vector<fleet::PledgedView> pledged;
  const fleet::Claims claims = conversion::ReadClaims(state.HeldClaims(), origin);
  for (const fleet::ViewClaim& claim : claims.held()) {
    pledged.push_back(
        {claim.position,
         conversion::ReadFleetMember(state.scanners.at(claim.scanner), state.session, origin).model,
         claim.heading});
  }
  return pledged;
}

std::vector<fleet::PledgedView> PendingViews(const SessionState& state,
                                             const Eigen::Vector3d& origin) {
  std::vector<fleet::PledgedView> pledged;
  for (const std::string& name : state.station_order) {
    pledged.push_back(
        conversion::ReadStation(state.stations.at(name), state.scanners, state.session, origin));
  }
  return pledged;
}

}  // namespace vantage::session
