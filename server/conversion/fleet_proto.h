// Conversion of the fleet between the wire and the core.
#ifndef VANTAGE_SERVER_CONVERSION_FLEET_PROTO_H_
#define VANTAGE_SERVER_CONVERSION_FLEET_PROTO_H_

#include <Eigen/Core>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/fleet/claims.h"
#include "core/fleet/fleet_request.h"
#include "core/fleet/joint_plan.h"
#include "server/contract/error.h"
#include "vantage/v1/event.pb.h"
#include "vantage/v1/fleet.pb.h"
#include "vantage/v1/plan.pb.h"
#include "vantage/v1/session.pb.h"

namespace vantage::conversion {

// Adds what is wrong with a scanner that is to be added, whatever the session.
void CheckScanner(const v1::Scanner& scanner, const std::string& field,
                  contract::Violations& violations);
void FillDefaults(v1::Scanner& scanner, const v1::Session& session);

// One of the session's scanner models by its id; null when it has none of that id.
const v1::ScannerModel* FindModel(const std::string& id, const v1::Session& session);

// The scanner's model; the session's first model where the scanner's own was removed.
const v1::ScannerModel& ModelOf(const v1::Scanner& scanner, const v1::Session& session);

fleet::FleetMember ReadFleetMember(const v1::Scanner& scanner, const v1::Session& session,
                                   const Eigen::Vector3d& origin);

// Claims that are held (SessionState::HeldClaims), in the model frame, in the same order.
fleet::Claims ReadClaims(std::span<const v1::Claim* const> held, const Eigen::Vector3d& origin);

// The view of a station's scan, in the model frame, by the station's scanner model; by its
// scanner's, or the session's first, where it names none or that was removed.
fleet::PledgedView ReadStation(const v1::Station& station,
                               const std::map<std::string, v1::Scanner>& scanners,
                               const v1::Session& session, const Eigen::Vector3d& origin);

v1::ClaimEndReason WriteClaimEnd(fleet::ClaimEnd end);
// For people: 'scan arrived', 'expired', 'released'.
const char* Words(v1::ClaimEndReason reason);

// Writes the assignments into a result that has the plan's views. `scanners` are the names of the
// request's scanners (none: the plan names no scanner), `claims` and then `stations` those of its
// pledged views.
void WriteJointPlan(const fleet::JointPlan& joint, const std::vector<std::string>& scanners,
                    const std::vector<std::string>& claims,
                    const std::vector<std::string>& stations, v1::PlanResult& result);

}  // namespace vantage::conversion

#endif  // VANTAGE_SERVER_CONVERSION_FLEET_PROTO_H_
