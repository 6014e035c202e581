// The views of a session that count as scanned although no scan from there is in the model yet.
#ifndef VANTAGE_SERVER_SESSION_PLEDGED_VIEWS_H_
#define VANTAGE_SERVER_SESSION_PLEDGED_VIEWS_H_

#include <Eigen/Core>
#include <vector>

#include "core/fleet/fleet_request.h"
#include "server/session/session_state.h"

namespace vantage::session {

// The views that are claimed, past their time or not, in the order of SessionState::HeldClaims().
// `origin` is that of the model frame in the world, m.
std::vector<fleet::PledgedView> ClaimedViews(const SessionState& state,
                                             const Eigen::Vector3d& origin);
// The stations whose scans have not come, in the order of SessionState::station_order.
std::vector<fleet::PledgedView> PendingViews(const SessionState& state,
                                             const Eigen::Vector3d& origin);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLEDGED_VIEWS_H_
