// The service from a client's side: every call of vantage.v1, with retries, resuming streams and
// errors that Explain() puts into words. Thread safe.
#ifndef VANTAGE_CLIENT_LIBRARY_CLIENT_H_
#define VANTAGE_CLIENT_LIBRARY_CLIENT_H_

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/library/client_options.h"
#include "client/library/contract_comparison.h"
#include "core/sensor/range_image.h"
#include "vantage/v1/fleet_service.pb.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan_service.pb.h"
#include "vantage/v1/scan_service.pb.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::client {

struct Wire;

// The progress of a scan on its way to the server.
struct UploadProgress {
  int64_t acknowledged_bytes = 0;  // stored by the server
  int64_t total_bytes = 0;
  int64_t sent_bytes = 0;  // on the wire, compressed, repetitions included
  int reconnects = 0;
  bool committed = false;
};

// The progress of an export on its way from the server.
struct ExportProgress {
  int64_t received_bytes = 0;
  int64_t total_bytes = 0;  // 0: not announced
};

// The clocks of both sides at one moment.
struct ServerTime {
  std::chrono::system_clock::time_point here;
  std::chrono::system_clock::time_point there;
};

// How a health check answered.
enum class Health { kServing, kNotServing, kUnknownService };

class Client {
 public:
  explicit Client(ClientOptions options);
  ~Client();

  const ClientOptions& options() const;

  // Unary calls. UNAVAILABLE is tried again with backoff: mutations without a request_id get one,
  // so that repeating them is harmless.
  absl::StatusOr<v1::CreateSessionResponse> Call(v1::CreateSessionRequest request);
  absl::StatusOr<v1::GetSessionResponse> Call(v1::GetSessionRequest request);
  absl::StatusOr<v1::ListSessionsResponse> Call(v1::ListSessionsRequest request);
  absl::StatusOr<v1::UpdateSessionResponse> Call(v1::UpdateSessionRequest request);
  absl::StatusOr<v1::DeleteSessionResponse> Call(v1::DeleteSessionRequest request);
  absl::StatusOr<v1::CreateUploadResponse> Call(v1::CreateUploadRequest request);
  absl::StatusOr<v1::GetUploadResponse> Call(v1::GetUploadRequest request);
  absl::StatusOr<v1::AbortUploadResponse> Call(v1::AbortUploadRequest request);
  absl::StatusOr<v1::ListUploadsResponse> Call(v1::ListUploadsRequest request);
  absl::StatusOr<v1::UploadPieceResponse> Call(v1::UploadPieceRequest request);
  absl::StatusOr<v1::GetScanResponse> Call(v1::GetScanRequest request);
  absl::StatusOr<v1::ListScansResponse> Call(v1::ListScansRequest request);
  absl::StatusOr<v1::AcceptScanResponse> Call(v1::AcceptScanRequest request);
  absl::StatusOr<v1::SetScanPoseResponse> Call(v1::SetScanPoseRequest request);
  absl::StatusOr<v1::WithdrawScanResponse> Call(v1::WithdrawScanRequest request);
  absl::StatusOr<v1::CreatePlanResponse> Call(v1::CreatePlanRequest request);
  absl::StatusOr<v1::CancelPlanResponse> Call(v1::CancelPlanRequest request);
  absl::StatusOr<v1::DeletePlanResponse> Call(v1::DeletePlanRequest request);
  absl::StatusOr<v1::GetPlanResponse> Call(v1::GetPlanRequest request);
  absl::StatusOr<v1::ListPlansResponse> Call(v1::ListPlansRequest request);
  absl::StatusOr<v1::EvaluateViewResponse> Call(v1::EvaluateViewRequest request);
  absl::StatusOr<v1::CompareScanPosesResponse> Call(v1::CompareScanPosesRequest request);
  absl::StatusOr<v1::RejectViewResponse> Call(v1::RejectViewRequest request);
  absl::StatusOr<v1::ListRejectionsResponse> Call(v1::ListRejectionsRequest request);
  absl::StatusOr<v1::DeleteRejectionResponse> Call(v1::DeleteRejectionRequest request);
  absl::StatusOr<v1::GetCoverageResponse> Call(v1::GetCoverageRequest request);
  absl::StatusOr<v1::GetPoseGraphResponse> Call(v1::GetPoseGraphRequest request);
  absl::StatusOr<v1::SetSitePriorResponse> Call(v1::SetSitePriorRequest request);
  absl::StatusOr<v1::GetSitePriorResponse> Call(v1::GetSitePriorRequest request);
  absl::StatusOr<v1::ClearSitePriorResponse> Call(v1::ClearSitePriorRequest request);
  absl::StatusOr<v1::CreateScannerResponse> Call(v1::CreateScannerRequest request);
  absl::StatusOr<v1::GetScannerResponse> Call(v1::GetScannerRequest request);
  absl::StatusOr<v1::ListScannersResponse> Call(v1::ListScannersRequest request);
  absl::StatusOr<v1::UpdateScannerResponse> Call(v1::UpdateScannerRequest request);
  absl::StatusOr<v1::DeleteScannerResponse> Call(v1::DeleteScannerRequest request);
  absl::StatusOr<v1::ClaimViewResponse> Call(v1::ClaimViewRequest request);
  absl::StatusOr<v1::RenewClaimResponse> Call(v1::RenewClaimRequest request);
  absl::StatusOr<v1::ReleaseClaimResponse> Call(v1::ReleaseClaimRequest request);
  absl::StatusOr<v1::GetClaimResponse> Call(v1::GetClaimRequest request);
  absl::StatusOr<v1::ListClaimsResponse> Call(v1::ListClaimsRequest request);
  absl::StatusOr<v1::CreateStationResponse> Call(v1::CreateStationRequest request);
  absl::StatusOr<v1::ListStationsResponse> Call(v1::ListStationsRequest request);
  absl::StatusOr<v1::DeleteStationResponse> Call(v1::DeleteStationRequest request);

  // Asks for one page of a list after the other; `add` is called with each, in order.
  template <typename Request, typename Add>
  absl::Status CallForPages(Request request, const Add& add) {
    do {
      auto page = Call(request);
      if (!page.ok()) return page.status();
      request.set_page_token(page->next_page_token());
      add(*std::move(page));
    } while (!request.page_token().empty());
    return absl::OkStatus();
  }

  // Sends a range image as one scan. Returns the scan's name once the server says it is committed.
  // After a break of the link the upload is resumed where the server says; a link that is silent
  // for too long is closed and opened anew. FAILED_PRECONDITION: the upload failed its checks on
  // the server. `upload` says what is known of the scan; its `total` is filled in. Repeating the
  // call, also from a program that was started anew, continues the upload and returns the same
  // scan, unless that scan was withdrawn. A caller that keeps the scan until this returns loses
  // nothing.
  absl::StatusOr<std::string> Upload(const std::string& session, v1::Upload upload,
                                     const sensor::RangeImage& image,
                                     absl::FunctionRef<void(const UploadProgress&)> progress);

  // The same of a file, of which the server makes a scan for each set-up (`upload.file`). Returns
  // the upload as it ended, with its scans. `bytes`: all of the file. `reading` is called about
  // twice a second while the server reads it. FAILED_PRECONDITION: no scan came of it.
  absl::StatusOr<v1::Upload> UploadFile(const std::string& session, v1::Upload upload,
                                        absl::string_view bytes,
                                        absl::FunctionRef<void(const UploadProgress&)> progress,
                                        absl::FunctionRef<void(const v1::Upload&)> reading);

  // Delivers every event of the session after a sequence number, until `on_event` returns false.
  // Resumes after breaks.
  absl::Status WatchSession(const std::string& session, uint64_t after_sequence,
                            absl::FunctionRef<bool(const v1::SessionEvent&)> on_event);

  // Follows a scan until it is merged, refused or withdrawn; `on_state` is called for every state
  // that it passes through.
  absl::StatusOr<v1::Scan> WaitForScan(const std::string& scan,
                                       absl::FunctionRef<void(const v1::Scan&)> on_state);

  // Follows a plan until it has ended; `on_revision` is called for every improvement that arrives.
  // Resumes after breaks.
  absl::StatusOr<v1::Plan> WatchPlan(const std::string& plan,
                                     absl::FunctionRef<void(const v1::Plan&)> on_revision);

  // Asks for a tour and follows it until it is as good as it gets within its budget; `on_tour` is
  // called for each that arrives, the last one too. After a break it is made anew.
  absl::StatusOr<v1::Tour> CreateTour(const v1::CreateTourRequest& request,
                                      absl::FunctionRef<void(const v1::Tour&)> on_tour);

  // A plan with its patches and its whole map of scores, page after page.
  absl::StatusOr<v1::Plan> GetFullPlan(const std::string& plan);

  // Streams an export; `sink` gets the bytes in order and may end it with an error. Each piece is
  // checked against its checksum and place: DATA_LOSS otherwise. Returns the suggested file name.
  // `progress` is called with each.
  absl::StatusOr<std::string> Export(const v1::ExportModelRequest& request,
                                     absl::FunctionRef<absl::Status(absl::string_view)> sink,
                                     absl::FunctionRef<void(const ExportProgress&)> progress);

  // The whole export in memory; starts again after a break.
  absl::StatusOr<std::string> ExportBytes(const v1::ExportModelRequest& request);
  // A job's report, likewise.
  absl::StatusOr<std::string> ExportBytes(const v1::ExportReportRequest& request);

  // Sends an archive of `size` bytes, from which the server makes a session, under `session_id`
  // where that is not empty. `read` gets an offset and gives the bytes from there on, as many as it
  // likes up to 1 MiB; it may be asked for earlier ones again, since the server says where to go
  // on. `progress` is called with how many bytes the server has.
  absl::StatusOr<v1::Session> Import(
      const std::string& session_id, int64_t size,
      absl::FunctionRef<absl::StatusOr<std::string>(int64_t offset)> read,
      absl::FunctionRef<void(int64_t sent)> progress);

  // What the server's contract has that this client's has not, and the other way round, by
  // reflection. UNIMPLEMENTED: it does not describe itself.
  absl::StatusOr<ContractComparison> CompareContract();

  // The clocks of both sides at one moment. `after_sequence`: the session's last event, since the
  // time comes when nothing else does, after 15 s at most. The server's is late by the way here.
  absl::StatusOr<ServerTime> ReadServerTime(const std::string& session, uint64_t after_sequence);

  // grpc.health.v1; an empty service means the server as a whole.
  absl::StatusOr<Health> CheckHealth(const std::string& service);

 private:
  // Export() without waiting for a model that is being loaded.
  absl::StatusOr<std::string> ExportOnce(const v1::ExportModelRequest& request,
                                         absl::FunctionRef<absl::Status(absl::string_view)> sink,
                                         absl::FunctionRef<void(const ExportProgress&)> progress);
  // Sends all of it; the upload as it is then.
  absl::StatusOr<v1::Upload> Send(const std::string& session, v1::Upload upload,
                                  absl::string_view bytes,
                                  absl::FunctionRef<void(const UploadProgress&)> on_progress);

  std::unique_ptr<Wire> wire_;
};

// True when the state changes no further unless a person acts.
bool IsDecided(v1::ScanState state);
bool HasEnded(v1::PlanState state);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_CLIENT_H_
