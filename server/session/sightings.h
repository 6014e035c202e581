// The targets that a scan saw, tied to what is known of their places.
#ifndef VANTAGE_SERVER_SESSION_SIGHTINGS_H_
#define VANTAGE_SERVER_SESSION_SIGHTINGS_H_

#include <Eigen/Core>
#include <vector>

#include "core/registration/align/targets.h"
#include "server/session/session_state.h"

namespace vantage::session {

// Those with places from a control network, and those that scans in the model saw too: of these the
// one whose own pose is known best says where. `origin`: the session's.
std::vector<registration::TargetTie> TiesOf(const SessionState& state, const v1::Scan& scan,
                                            const Eigen::Vector3d& origin);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SIGHTINGS_H_
