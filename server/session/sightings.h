// The targets that a scan of a session saw, with their known places.
#ifndef VANTAGE_SERVER_SESSION_SIGHTINGS_H_
#define VANTAGE_SERVER_SESSION_SIGHTINGS_H_

#include <Eigen/Core>
#include <vector>

#include "core/planning/plan/target_advice.h"
#include "core/registration/align/targets.h"
#include "core/registration/sightings.h"
#include "server/session/session_state.h"

namespace vantage::session {

// registration::TiesOf() the scan's targets and those of all scans in the model. `origin`: the
// session's origin, m, world frame.
std::vector<registration::TargetTie> TiesOf(const SessionState& state, const v1::Scan& scan,
                                            const Eigen::Vector3d& origin);

// The targets whose places are known, and the scans in the model, in their order.
std::vector<registration::KnownTarget> KnownTargetsOf(const SessionState& state,
                                                      const Eigen::Vector3d& origin);
std::vector<planning::ScannedFrom> ScannedFromOf(const SessionState& state,
                                                 const Eigen::Vector3d& origin);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SIGHTINGS_H_
