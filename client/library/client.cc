#include "client/library/client.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/library/backoff.h"
#include "client/library/error.h"
#include "client/library/loading_wait.h"
#include "client/library/wire.h"
#include "core/bytes/checksum.h"

namespace vantage::client {
namespace {

// Tells of a call while it is under way.
class CallShown {
 public:
  explicit CallShown(const ClientOptions& options) : options_(options) {
    if (options_.on_call) options_.on_call(true);
  }
  ~CallShown() {
    if (options_.on_call) options_.on_call(false);
  }
  CallShown(const CallShown&) = delete;
  CallShown& operator=(const CallShown&) = delete;

 private:
  const ClientOptions& options_;
};

// One unary call with its attempts.
template <typename Request, typename Response, typename Stub>
absl::StatusOr<Response> CallUnary(Stub& stub,
                                   grpc::Status (Stub::*method)(grpc::ClientContext*,
                                                                const Request&, Response*),
                                   const Wire& wire, Request request) {
  if constexpr (requires { request.set_request_id(std::string()); }) {
    if (request.request_id().empty()) request.set_request_id(NewRequestId());
  }
  const ClientOptions& options = wire.options;
  const CallShown shown(options);
  auto deadline = DeadlineIn(options.timeout);
  Backoff backoff(RandomSeed());
  LoadingWait loading(options);
  absl::Status failure;
  for (int attempt = 0; attempt < options.attempts; ++attempt) {
    if (attempt > 0) {
      const double wait = backoff.Next(Explain(failure).retry_seconds);
      if (DeadlineIn(wait) > deadline) break;
      wire.Wait(wait);
    }
    grpc::ClientContext context;
    context.set_deadline(deadline);
    if (absl::Status prepared = wire.Prepare(context); !prepared.ok()) return prepared;
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    if (status.ok()) return response;
    failure = FromRpc(status, options.server);
    if (loading.After(failure)) {
      attempt = -1;
      deadline = DeadlineIn(options.timeout);
      continue;
    }
    if (!IsTransient(failure)) break;
  }
  return failure;
}

}  // namespace

Client::Client(ClientOptions options) : wire_(std::make_unique<Wire>(std::move(options))) {}
Client::~Client() = default;

const ClientOptions& Client::options() const { return wire_->options; }

absl::StatusOr<v1::CreateSessionResponse> Client::Call(v1::CreateSessionRequest request) {
  return CallUnary(*wire_->sessions, &v1::SessionService::Stub::CreateSession, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::GetSessionResponse> Client::Call(v1::GetSessionRequest request) {
  return CallUnary(*wire_->sessions, &v1::SessionService::Stub::GetSession, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::ListSessionsResponse> Client::Call(v1::ListSessionsRequest request) {
  return CallUnary(*wire_->sessions, &v1::SessionService::Stub::ListSessions, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::UpdateSessionResponse> Client::Call(v1::UpdateSessionRequest request) {
  return CallUnary(*wire_->sessions, &v1::SessionService::Stub::UpdateSession, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::DeleteSessionResponse> Client::Call(v1::DeleteSessionRequest request) {
  return CallUnary(*wire_->sessions, &v1::SessionService::Stub::DeleteSession, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::CreateUploadResponse> Client::Call(v1::CreateUploadRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::CreateUpload, *wire_, std::move(request));
}
absl::StatusOr<v1::GetUploadResponse> Client::Call(v1::GetUploadRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::GetUpload, *wire_, std::move(request));
}
absl::StatusOr<v1::AbortUploadResponse> Client::Call(v1::AbortUploadRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::AbortUpload, *wire_, std::move(request));
}
absl::StatusOr<v1::ListUploadsResponse> Client::Call(v1::ListUploadsRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::ListUploads, *wire_, std::move(request));
}
absl::StatusOr<v1::UploadPieceResponse> Client::Call(v1::UploadPieceRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::UploadPiece, *wire_, std::move(request));
}
absl::StatusOr<v1::GetScanResponse> Client::Call(v1::GetScanRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::GetScan, *wire_, std::move(request));
}
absl::StatusOr<v1::ListScansResponse> Client::Call(v1::ListScansRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::ListScans, *wire_, std::move(request));
}
absl::StatusOr<v1::AcceptScanResponse> Client::Call(v1::AcceptScanRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::AcceptScan, *wire_, std::move(request));
}
absl::StatusOr<v1::SetScanPoseResponse> Client::Call(v1::SetScanPoseRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::SetScanPose, *wire_, std::move(request));
}
absl::StatusOr<v1::WithdrawScanResponse> Client::Call(v1::WithdrawScanRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::WithdrawScan, *wire_, std::move(request));
}
absl::StatusOr<v1::CreatePlanResponse> Client::Call(v1::CreatePlanRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::CreatePlan, *wire_, std::move(request));
}
absl::StatusOr<v1::CancelPlanResponse> Client::Call(v1::CancelPlanRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::CancelPlan, *wire_, std::move(request));
}
absl::StatusOr<v1::DeletePlanResponse> Client::Call(v1::DeletePlanRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::DeletePlan, *wire_, std::move(request));
}
absl::StatusOr<v1::GetPlanResponse> Client::Call(v1::GetPlanRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::GetPlan, *wire_, std::move(request));
}
absl::StatusOr<v1::ListPlansResponse> Client::Call(v1::ListPlansRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::ListPlans, *wire_, std::move(request));
}
absl::StatusOr<v1::CompareScanPosesResponse> Client::Call(v1::CompareScanPosesRequest request) {
  return CallUnary(*wire_->scans, &v1::ScanService::Stub::CompareScanPoses, *wire_,
                   std::move(request));
}

absl::StatusOr<v1::EvaluateViewResponse> Client::Call(v1::EvaluateViewRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::EvaluateView, *wire_, std::move(request));
}
absl::StatusOr<v1::RejectViewResponse> Client::Call(v1::RejectViewRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::RejectView, *wire_, std::move(request));
}
absl::StatusOr<v1::ListRejectionsResponse> Client::Call(v1::ListRejectionsRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::ListRejections, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::DeleteRejectionResponse> Client::Call(v1::DeleteRejectionRequest request) {
  return CallUnary(*wire_->plans, &v1::PlanService::Stub::DeleteRejection, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::GetCoverageResponse> Client::Call(v1::GetCoverageRequest request) {
  return CallUnary(*wire_->model, &v1::ModelService::Stub::GetCoverage, *wire_, std::move(request));
}
absl::StatusOr<v1::GetPoseGraphResponse> Client::Call(v1::GetPoseGraphRequest request) {
  return CallUnary(*wire_->model, &v1::ModelService::Stub::GetPoseGraph, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::SetSitePriorResponse> Client::Call(v1::SetSitePriorRequest request) {
  return CallUnary(*wire_->model, &v1::ModelService::Stub::SetSitePrior, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::GetSitePriorResponse> Client::Call(v1::GetSitePriorRequest request) {
  return CallUnary(*wire_->model, &v1::ModelService::Stub::GetSitePrior, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::ClearSitePriorResponse> Client::Call(v1::ClearSitePriorRequest request) {
  return CallUnary(*wire_->model, &v1::ModelService::Stub::ClearSitePrior, *wire_,
                   std::move(request));
}

absl::StatusOr<v1::CreateScannerResponse> Client::Call(v1::CreateScannerRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::CreateScanner, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::GetScannerResponse> Client::Call(v1::GetScannerRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::GetScanner, *wire_, std::move(request));
}
absl::StatusOr<v1::ListScannersResponse> Client::Call(v1::ListScannersRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::ListScanners, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::UpdateScannerResponse> Client::Call(v1::UpdateScannerRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::UpdateScanner, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::DeleteScannerResponse> Client::Call(v1::DeleteScannerRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::DeleteScanner, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::ClaimViewResponse> Client::Call(v1::ClaimViewRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::ClaimView, *wire_, std::move(request));
}
absl::StatusOr<v1::RenewClaimResponse> Client::Call(v1::RenewClaimRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::RenewClaim, *wire_, std::move(request));
}
absl::StatusOr<v1::ReleaseClaimResponse> Client::Call(v1::ReleaseClaimRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::ReleaseClaim, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::GetClaimResponse> Client::Call(v1::GetClaimRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::GetClaim, *wire_, std::move(request));
}
absl::StatusOr<v1::CreateStationResponse> Client::Call(v1::CreateStationRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::CreateStation, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::ListStationsResponse> Client::Call(v1::ListStationsRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::ListStations, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::DeleteStationResponse> Client::Call(v1::DeleteStationRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::DeleteStation, *wire_,
                   std::move(request));
}
absl::StatusOr<v1::ListClaimsResponse> Client::Call(v1::ListClaimsRequest request) {
  return CallUnary(*wire_->fleet, &v1::FleetService::Stub::ListClaims, *wire_, std::move(request));
}

absl::StatusOr<v1::Session> Client::Import(
    const std::string& session_id, int64_t size,
    absl::FunctionRef<absl::StatusOr<std::string>(int64_t offset)> read,
    absl::FunctionRef<void(int64_t sent)> progress) {
  // A server that was started anew has nothing of it: it is sent again, so often at most.
  constexpr int kBeginnings = 5;
  const std::string request_id = NewRequestId();
  int begun = 0;
  for (int64_t offset = 0; offset < size;) {
    if (offset == 0 && ++begun > kBeginnings) break;
    absl::StatusOr<std::string> bytes = read(offset);
    if (!bytes.ok()) return bytes.status();
    if (bytes->empty()) return absl::DataLossError("the archive ended before its end");
    v1::ImportSessionRequest request;
    request.set_request_id(request_id);
    request.set_session_id(session_id);
    request.set_offset(offset);
    request.set_crc32c(bytes::Crc32c(*bytes));
    *request.mutable_data() = *std::move(bytes);
    const auto taken =
        CallUnary(*wire_->sessions, &v1::SessionService::Stub::ImportSession, *wire_, request);
    if (taken.ok()) {
      if (taken->has_session()) return taken->session();
      offset = taken->next_offset();
      progress(offset);
      continue;
    }
    const Explanation why = Explain(taken.status());
    if (why.reason == "PIECE_DAMAGED" && ++begun <= kBeginnings) continue;
    const auto next = why.metadata.find("next_offset");
    if (why.reason != "IMPORT_GAP" || next == why.metadata.end() ||
        !absl::SimpleAtoi(next->second, &offset)) {
      return taken.status();
    }
  }
  return WithFix(
      absl::DataLossError("the archive was sent, and the server has no whole session of it"),
      "export it again");
}

absl::StatusOr<Health> Client::CheckHealth(const std::string& service) {
  grpc::health::v1::HealthCheckRequest request;
  request.set_service(service);
  auto response =
      CallUnary(*wire_->health, &grpc::health::v1::Health::Stub::Check, *wire_, std::move(request));
  if (absl::IsNotFound(response.status())) return Health::kUnknownService;
  if (!response.ok()) return response.status();
  return response->status() == grpc::health::v1::HealthCheckResponse::SERVING ? Health::kServing
                                                                              : Health::kNotServing;
}

absl::StatusOr<ContractComparison> Client::CompareContract() {
  const auto server = ReflectedContract(*wire_);
  if (!server.ok()) return server.status();
  return CompareContracts(*server);
}

bool IsDecided(v1::ScanState state) {
  return state == v1::SCAN_STATE_MERGED || state == v1::SCAN_STATE_DOUBTFUL ||
         state == v1::SCAN_STATE_FAILED || state == v1::SCAN_STATE_WITHDRAWN;
}

bool HasEnded(v1::PlanState state) {
  return state == v1::PLAN_STATE_SUCCEEDED || state == v1::PLAN_STATE_CANCELLED ||
         state == v1::PLAN_STATE_FAILED;
}

}  // namespace vantage::client
