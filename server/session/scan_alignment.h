// Aligns a session's scan to its model by all that the session knows of it.
#ifndef VANTAGE_SERVER_SESSION_SCAN_ALIGNMENT_H_
#define VANTAGE_SERVER_SESSION_SCAN_ALIGNMENT_H_

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"
#include "server/session/session_context.h"
#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// Starts from the scan's prior, from where the headers of other scans say that its own has it, from
// its targets, or anywhere; with the places that its targets have by now, and what the job's scans
// have shown of the instrument. `data` may lose its prior, or get another one. A function of the
// log's state and of the model, whenever it is called. Errors as Algorithms::register_scan's.
absl::StatusOr<registration::RegistrationResult> AlignToModel(const SessionContext& context,
                                                              const model::PlanningView& model,
                                                              const v1::Scan& scan,
                                                              sensor::Scan& data,
                                                              parallel::Parallel& parallel);

// The scan in the model that stands nearest to a pose, and where it does: what is registered there
// goes along when that one is moved. `scan` itself does not count.
v1::PoseReference NearestInModel(const SessionContext& context, const v1::Scan& scan,
                                 const Eigen::Isometry3d& T_model_scan);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCAN_ALIGNMENT_H_
