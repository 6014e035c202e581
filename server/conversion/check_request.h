// Checks of requests by themselves: what needs neither a session's state nor its model to be found
// wrong. Handlers call them; what a session is asked afterwards is valid but for its state.
//
// Each returns INVALID_ARGUMENT with all violations, under the paths of their fields.
#ifndef VANTAGE_SERVER_CONVERSION_CHECK_REQUEST_H_
#define VANTAGE_SERVER_CONVERSION_CHECK_REQUEST_H_

#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "google/protobuf/duration.pb.h"
#include "server/contract/error.h"
#include "server/contract/limits.h"
#include "vantage/v1/fleet_service.pb.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::conversion {

absl::Status CheckRequest(const v1::CreateSessionRequest& request);
absl::Status CheckRequest(const v1::ListSessionsRequest& request);
// The mask; the session that it makes is checked where the session before it is known.
absl::Status CheckRequest(const v1::UpdateSessionRequest& request);
absl::Status CheckRequest(const v1::DeleteSessionRequest& request);
absl::Status CheckRequest(const v1::ImportSessionRequest& request, const contract::Limits& limits);

absl::Status CheckRequest(const v1::CreateUploadRequest& request, const contract::Limits& limits);
absl::Status CheckRequest(const v1::ListUploadsRequest& request);
absl::Status CheckRequest(const v1::AbortUploadRequest& request);
absl::Status CheckRequest(const v1::ListScansRequest& request);
absl::Status CheckRequest(const v1::AcceptScanRequest& request);
absl::Status CheckRequest(const v1::CompareScanPosesRequest& request);
absl::Status CheckRequest(const v1::SetScanPoseRequest& request);
absl::Status CheckRequest(const v1::WithdrawScanRequest& request);

// The budget and the ranking; what overrides a session's configuration is checked together with it.
absl::Status CheckRequest(const v1::CreatePlanRequest& request);
absl::Status CheckRequest(const v1::CancelPlanRequest& request);
absl::Status CheckRequest(const v1::DeletePlanRequest& request);
absl::Status CheckRequest(const v1::ListPlansRequest& request);
absl::Status CheckRequest(const v1::EvaluateViewRequest& request);
// But for the names of scanners and rooms, which are checked where the session is known.
absl::Status CheckRequest(const v1::CreateTourRequest& request);
absl::Status CheckRequest(const v1::RejectViewRequest& request);
absl::Status CheckRequest(const v1::DeleteRejectionRequest& request);

absl::Status CheckRequest(const v1::ExportModelRequest& request);
// But for the language: who writes the report knows which there are.
absl::Status CheckRequest(const v1::ExportReportRequest& request);

// What is in the file is told when it is read.
absl::Status CheckRequest(const v1::SetSitePriorRequest& request);
absl::Status CheckRequest(const v1::ClearSitePriorRequest& request);

absl::Status CheckRequest(const v1::CreateScannerRequest& request);
// The mask and the fields that it names; the model is checked where the session is known.
absl::Status CheckRequest(const v1::UpdateScannerRequest& request);
absl::Status CheckRequest(const v1::DeleteScannerRequest& request);
absl::Status CheckRequest(const v1::ClaimViewRequest& request);
absl::Status CheckRequest(const v1::RenewClaimRequest& request);
absl::Status CheckRequest(const v1::ReleaseClaimRequest& request);
absl::Status CheckRequest(const v1::CreateStationRequest& request);
absl::Status CheckRequest(const v1::DeleteStationRequest& request);

// The fields of a prior of the site that a client sets; of one that is logged, too.
void CheckSitePrior(const v1::SitePrior& prior, const std::string& field,
                    contract::Violations& violations);

// The fields of a new session that a client sets, completed by their defaults; fields that the
// server sets are left out.
v1::Session Completed(const v1::Session& asked);

// How long a plan may take: a time or a work limit, the other being 0.
struct PlanBudget {
  double seconds = 0;
  uint64_t work_limit = 0;  // rays
};
PlanBudget ReadPlanBudget(const v1::Plan& plan);
PlanBudget ReadTourBudget(const v1::TourWish& wish);
// m; the default where the request has none.
double ReadRadius(const v1::RejectViewRequest& request);
// How long a claim holds; the default where the request has none.
absl::Duration ReadTtl(const v1::ClaimViewRequest& request);
absl::Duration ReadTtl(const v1::RenewClaimRequest& request);

}  // namespace vantage::conversion

#endif  // VANTAGE_SERVER_CONVERSION_CHECK_REQUEST_H_
