// One function per unary RPC: validate, call the session, convert. Free of gRPC; each has its own
// file (reads of one resource, and its listing, share one).
#ifndef VANTAGE_SERVER_RPC_HANDLERS_HANDLERS_H_
#define VANTAGE_SERVER_RPC_HANDLERS_HANDLERS_H_

#include <functional>
#include <stop_token>

#include "absl/status/statusor.h"
#include "server/session/tenant_sessions.h"
#include "vantage/v1/fleet_service.pb.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::rpc::handlers {

// Sessions.
absl::StatusOr<v1::CreateSessionResponse> CreateSession(const session::TenantSessions& sessions,
                                                        const v1::CreateSessionRequest& request);
absl::StatusOr<v1::GetSessionResponse> GetSession(const session::TenantSessions& sessions,
                                                  const v1::GetSessionRequest& request);
absl::StatusOr<v1::ListSessionsResponse> ListSessions(const session::TenantSessions& sessions,
                                                      const v1::ListSessionsRequest& request);
absl::StatusOr<v1::UpdateSessionResponse> UpdateSession(const session::TenantSessions& sessions,
                                                        const v1::UpdateSessionRequest& request);
absl::StatusOr<v1::DeleteSessionResponse> DeleteSession(const session::TenantSessions& sessions,
                                                        const v1::DeleteSessionRequest& request);

absl::StatusOr<v1::ImportSessionResponse> ImportSession(const session::TenantSessions& sessions,
                                                        const v1::ImportSessionRequest& request);

// Uploads and scans.
absl::StatusOr<v1::CreateUploadResponse> CreateUpload(const session::TenantSessions& sessions,
                                                      const v1::CreateUploadRequest& request);
absl::StatusOr<v1::GetUploadResponse> GetUpload(const session::TenantSessions& sessions,
                                                const v1::GetUploadRequest& request);
absl::StatusOr<v1::ListUploadsResponse> ListUploads(const session::TenantSessions& sessions,
                                                    const v1::ListUploadsRequest& request);
absl::StatusOr<v1::AbortUploadResponse> AbortUpload(const session::TenantSessions& sessions,
                                                    const v1::AbortUploadRequest& request);
absl::StatusOr<v1::UploadPieceResponse> UploadPiece(const session::TenantSessions& sessions,
                                                    const v1::UploadPieceRequest& request);
absl::StatusOr<v1::GetScanResponse> GetScan(const session::TenantSessions& sessions,
                                            const v1::GetScanRequest& request);
absl::StatusOr<v1::ListScansResponse> ListScans(const session::TenantSessions& sessions,
                                                const v1::ListScansRequest& request);
absl::StatusOr<v1::AcceptScanResponse> AcceptScan(const session::TenantSessions& sessions,
                                                  const v1::AcceptScanRequest& request);
// Answers on the planning pool; `done` is called exactly once.
void CompareScanPoses(const session::TenantSessions& sessions,
                      const v1::CompareScanPosesRequest& request,
                      std::function<void(absl::StatusOr<v1::CompareScanPosesResponse>)> done);
absl::StatusOr<v1::SetScanPoseResponse> SetScanPose(const session::TenantSessions& sessions,
                                                    const v1::SetScanPoseRequest& request);
absl::StatusOr<v1::WithdrawScanResponse> WithdrawScan(const session::TenantSessions& sessions,
                                                      const v1::WithdrawScanRequest& request);

// Plans.
absl::StatusOr<v1::CreatePlanResponse> CreatePlan(const session::TenantSessions& sessions,
                                                  const v1::CreatePlanRequest& request);
absl::StatusOr<v1::GetPlanResponse> GetPlan(const session::TenantSessions& sessions,
                                            const v1::GetPlanRequest& request);
absl::StatusOr<v1::ListPlansResponse> ListPlans(const session::TenantSessions& sessions,
                                                const v1::ListPlansRequest& request);
absl::StatusOr<v1::CancelPlanResponse> CancelPlan(const session::TenantSessions& sessions,
                                                  const v1::CancelPlanRequest& request);
absl::StatusOr<v1::DeletePlanResponse> DeletePlan(const session::TenantSessions& sessions,
                                                  const v1::DeletePlanRequest& request);
absl::StatusOr<v1::RejectViewResponse> RejectView(const session::TenantSessions& sessions,
                                                  const v1::RejectViewRequest& request);
absl::StatusOr<v1::ListRejectionsResponse> ListRejections(const session::TenantSessions& sessions,
                                                          const v1::ListRejectionsRequest& request);
absl::StatusOr<v1::DeleteRejectionResponse> DeleteRejection(
    const session::TenantSessions& sessions, const v1::DeleteRejectionRequest& request);
// Answers on the planning pool; `done` is called exactly once.
void EvaluateView(const session::TenantSessions& sessions, const v1::EvaluateViewRequest& request,
                  const std::stop_token& gone,
                  std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done);

// The model.
absl::StatusOr<v1::GetCoverageResponse> GetCoverage(const session::TenantSessions& sessions,
                                                    const v1::GetCoverageRequest& request);
// Answers on the planning pool; `done` is called exactly once.
void GetPoseGraph(const session::TenantSessions& sessions, const v1::GetPoseGraphRequest& request,
                  std::function<void(absl::StatusOr<v1::GetPoseGraphResponse>)> done);

// Answer on the planning pool; `done` is called exactly once.
void SetSitePrior(const session::TenantSessions& sessions, const v1::SetSitePriorRequest& request,
                  std::function<void(absl::StatusOr<v1::SetSitePriorResponse>)> done);
void GetSitePrior(const session::TenantSessions& sessions, const v1::GetSitePriorRequest& request,
                  const std::stop_token& gone,
                  std::function<void(absl::StatusOr<v1::GetSitePriorResponse>)> done);
absl::StatusOr<v1::ClearSitePriorResponse> ClearSitePrior(const session::TenantSessions& sessions,
                                                          const v1::ClearSitePriorRequest& request);

// The fleet.
absl::StatusOr<v1::CreateScannerResponse> CreateScanner(const session::TenantSessions& sessions,
                                                        const v1::CreateScannerRequest& request);
absl::StatusOr<v1::GetScannerResponse> GetScanner(const session::TenantSessions& sessions,
                                                  const v1::GetScannerRequest& request);
absl::StatusOr<v1::ListScannersResponse> ListScanners(const session::TenantSessions& sessions,
                                                      const v1::ListScannersRequest& request);
absl::StatusOr<v1::UpdateScannerResponse> UpdateScanner(const session::TenantSessions& sessions,
                                                        const v1::UpdateScannerRequest& request);
absl::StatusOr<v1::DeleteScannerResponse> DeleteScanner(const session::TenantSessions& sessions,
                                                        const v1::DeleteScannerRequest& request);
// Answers on the planning pool; `done` is called exactly once.
void ClaimView(const session::TenantSessions& sessions, const v1::ClaimViewRequest& request,
               const std::stop_token& gone,
               std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done);
absl::StatusOr<v1::RenewClaimResponse> RenewClaim(const session::TenantSessions& sessions,
                                                  const v1::RenewClaimRequest& request);
absl::StatusOr<v1::ReleaseClaimResponse> ReleaseClaim(const session::TenantSessions& sessions,
                                                      const v1::ReleaseClaimRequest& request);
absl::StatusOr<v1::GetClaimResponse> GetClaim(const session::TenantSessions& sessions,
                                              const v1::GetClaimRequest& request);
absl::StatusOr<v1::ListClaimsResponse> ListClaims(const session::TenantSessions& sessions,
                                                  const v1::ListClaimsRequest& request);
// Answers on the planning pool; `done` is called exactly once.
void CreateStation(const session::TenantSessions& sessions, const v1::CreateStationRequest& request,
                   std::function<void(absl::StatusOr<v1::CreateStationResponse>)> done);
absl::StatusOr<v1::GetStationResponse> GetStation(const session::TenantSessions& sessions,
                                                  const v1::GetStationRequest& request);
absl::StatusOr<v1::ListStationsResponse> ListStations(const session::TenantSessions& sessions,
                                                      const v1::ListStationsRequest& request);
absl::StatusOr<v1::DeleteStationResponse> DeleteStation(const session::TenantSessions& sessions,
                                                        const v1::DeleteStationRequest& request);

}  // namespace vantage::rpc::handlers

#endif  // VANTAGE_SERVER_RPC_HANDLERS_HANDLERS_H_
