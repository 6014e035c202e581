#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <future>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "server/contract/error.h"
#include "server/conversion/check_request.h"
#include "server/report/report.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"
#include "server/session/export.h"
#include "server/session/session_registry.h"
#include "server/store/memory_store.h"

namespace vantage::fuzz {
namespace {

// Algorithms that refuse: what is looked at is what comes before them.
session::Algorithms Refusing() {
  const absl::Status no = absl::FailedPreconditionError("not here");
  session::Algorithms algorithms;
  algorithms.level = [no](const sensor::Scan&) -> absl::StatusOr<registration::Levelling> {
    return no;
  };
  algorithms.register_scan =
      [no](const model::PlanningView&, const sensor::Scan&, const Eigen::Isometry3d&,
           std::span<const registration::TargetTie>, const registration::RegistrationConfig&,
           parallel::Parallel&) -> absl::StatusOr<registration::RegistrationResult> { return no; };
  algorithms.make_plan =
      [no](const session::PlanningTask&, const parallel::Budget&, parallel::Parallel&,
           planning::PlanProgress) -> absl::StatusOr<planning::Plan> { return no; };
  algorithms.evaluate_view =
      [no](const session::PlanningTask&, const Eigen::Vector3d&, parallel::Parallel&,
           std::optional<double>) -> absl::StatusOr<planning::ViewEvaluation> { return no; };
  algorithms.compare_poses =
      [no](const model::PlanningView&, const sensor::Scan&, std::span<const Eigen::Isometry3d>,
           const registration::RegistrationConfig&, const registration::ComparisonSize&,
           parallel::Parallel&) -> absl::StatusOr<registration::PoseComparison> { return no; };
  algorithms.make_tour = [no](const session::PlanningTask&, const tour::TourRequest&,
                              const parallel::Budget&, parallel::Parallel&,
                              tour::TourProgress) -> absl::StatusOr<tour::Tour> { return no; };
  algorithms.measure_site =
      [](const model::PlanningView&, std::span<const sensor::ScannerModel>,
         const planning::PlanningConfig&) -> absl::StatusOr<planning::CoveredSite> {
    return planning::CoveredSite();
  };
  return algorithms;
}

using Handle = std::function<absl::Status(const session::TenantSessions&, const std::string&)>;

template <typename Request, typename Response>
Handle Of(absl::StatusOr<Response> (*handler)(const session::TenantSessions&, const Request&)) {
  return
      [handler](const session::TenantSessions& sessions, const std::string& bytes) -> absl::Status {
        Request request;
        if (!request.ParseFromString(bytes)) return absl::OkStatus();
        return handler(sessions, request).status();
      };
}

// Of what answers later, on another thread: `start` gets sessions, request and whom to answer.
template <typename Request, typename Response, typename Start>
Handle AnsweredLater(Start start) {
  return
      [start](const session::TenantSessions& sessions, const std::string& bytes) -> absl::Status {
        Request request;
        if (!request.ParseFromString(bytes)) return absl::OkStatus();
        std::promise<absl::Status> answer;
        start(sessions, request,
              [&](absl::StatusOr<Response> response) { answer.set_value(response.status()); });
        return answer.get_future().get();
      };
}

template <typename Request, typename Response>
Handle Of(void (*handler)(const session::TenantSessions&, const Request&,
                          std::function<void(absl::StatusOr<Response>)>)) {
  return AnsweredLater<Request, Response>(handler);
}

// Of one that ends when its caller has gone, which this one does not.
template <typename Request, typename Response>
Handle Of(void (*handler)(const session::TenantSessions&, const Request&, const std::stop_token&,
                          std::function<void(absl::StatusOr<Response>)>)) {
  return AnsweredLater<Request, Response>(
      [handler](const session::TenantSessions& sessions, const Request& request, auto done) {
        handler(sessions, request, std::stop_token(), std::move(done));
      });
}

absl::Status ExportAll(const session::TenantSessions& sessions, const std::string& bytes) {
  v1::ExportModelRequest request;
  if (!request.ParseFromString(bytes)) return absl::OkStatus();
  const auto session = rpc::FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  const auto source = session::Export::Create(*session, request);
  if (!source.ok()) return source.status();
  while (true) {
    const absl::StatusOr<std::string> part = (*source)->Next();
    if (!part.ok() || part->empty()) return part.status();
  }
}

absl::Status ReportAll(const session::TenantSessions& sessions, const std::string& bytes) {
  v1::ExportReportRequest request;
  if (!request.ParseFromString(bytes)) return absl::OkStatus();
  const auto session = rpc::FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  const auto source = report::Report::Create(*session, request);
  if (!source.ok()) return source.status();
  while (true) {
    const absl::StatusOr<std::string> part = (*source)->Next();
    if (!part.ok() || part->empty()) return part.status();
  }
}

absl::Status TourOf(const session::TenantSessions& sessions, const std::string& bytes) {
  v1::CreateTourRequest request;
  if (!request.ParseFromString(bytes)) return absl::OkStatus();
  const auto session = rpc::FindForWork(sessions, request);
  if (!session.ok()) return session.status();
  const auto run = (*session)->tours().Create(request);
  if (!run.ok()) return run.status();
  // Whoever tells may do so for the last time when this has returned.
  struct Told {
    std::promise<void> promise;
    std::atomic<bool> once = false;
  };
  const auto told = std::make_shared<Told>();
  const auto tell = [told, run = *run] {
    if (run->Ended() && !told->once.exchange(true)) told->promise.set_value();
  };
  (*run)->Tell(tell);
  tell();
  told->promise.get_future().wait();
  (*run)->Tell(nullptr);
  return (*run)->Take().status;
}

const std::vector<Handle>& Handlers() {
  static const auto& all = *new std::vector<Handle>{
      Of(rpc::handlers::CreateSession),
      Of(rpc::handlers::GetSession),
      Of(rpc::handlers::ListSessions),
      Of(rpc::handlers::UpdateSession),
      Of(rpc::handlers::DeleteSession),
      Of(rpc::handlers::ImportSession),
      Of(rpc::handlers::CreateUpload),
      Of(rpc::handlers::GetUpload),
      Of(rpc::handlers::ListUploads),
      Of(rpc::handlers::AbortUpload),
      Of(rpc::handlers::UploadPiece),
      Of(rpc::handlers::GetScan),
      Of(rpc::handlers::ListScans),
      Of(rpc::handlers::AcceptScan),
      Of(rpc::handlers::CompareScanPoses),
      Of(rpc::handlers::SetScanPose),
      Of(rpc::handlers::WithdrawScan),
      Of(rpc::handlers::CreatePlan),
      Of(rpc::handlers::GetPlan),
      Of(rpc::handlers::ListPlans),
      Of(rpc::handlers::CancelPlan),
      Of(rpc::handlers::DeletePlan),
      Of(rpc::handlers::RejectView),
      Of(rpc::handlers::ListRejections),
      Of(rpc::handlers::DeleteRejection),
      Of(rpc::handlers::GetCoverage),
      Of(rpc::handlers::CreateScanner),
      Of(rpc::handlers::GetScanner),
      Of(rpc::handlers::ListScanners),
      Of(rpc::handlers::UpdateScanner),
      Of(rpc::handlers::DeleteScanner),
      Of(rpc::handlers::RenewClaim),
      Of(rpc::handlers::ReleaseClaim),
      Of(rpc::handlers::GetClaim),
      Of(rpc::handlers::ListClaims),
      Of(rpc::handlers::ClaimView),
      Of(rpc::handlers::CreateStation),
      Of(rpc::handlers::GetStation),
      Of(rpc::handlers::ListStations),
      Of(rpc::handlers::DeleteStation),
      Of(rpc::handlers::EvaluateView),
      Of(rpc::handlers::GetPoseGraph),
      Of(rpc::handlers::SetSitePrior),
      Of(rpc::handlers::GetSitePrior),
      Of(rpc::handlers::ClearSitePrior),
      ExportAll,
      ReportAll,
      TourOf,
  };
  return all;
}

}  // namespace
}  // namespace vantage::fuzz

// Several requests, one after the other, to a server that has one session with two uploads: a byte
// for the method, two for the length, the message. Each is answered with a canonical code that
// blames nobody's programming.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace vantage;  // NOLINT: the entry point's name is not ours
  static telemetry::Log& log = *new telemetry::Log(telemetry::Log::Silent());
  static execution::Timer& timer = *new execution::Timer();
  static execution::PlanningPool& pool = *new execution::PlanningPool(1, 2);
  store::MemoryStore store(size_t{64} << 20);
  session::SessionRegistry registry(
      session::SessionDependencies{store, pool, timer, log, contract::Limits(), fuzz::Refusing(),
                                   [] { return absl::FromUnixSeconds(1'700'000'000); }});
  const session::TenantSessions sessions(registry, "tenant");
  v1::CreateSessionRequest create;
  create.set_session_id("job");
  if (!rpc::handlers::CreateSession(sessions, create).ok()) std::abort();
  v1::CreateUploadRequest announce;
  announce.set_parent("sessions/job");
  if (!rpc::handlers::CreateUpload(sessions, announce).ok()) std::abort();
  // And one of a file; no input comes to its SHA-256, so that none is read.
  announce.mutable_upload()->mutable_file()->set_name("scan.e57");
  announce.mutable_upload()->mutable_total()->set_encoded_size_bytes(1000);
  announce.mutable_upload()->mutable_total()->set_sha256(std::string(32, '\1'));
  if (!rpc::handlers::CreateUpload(sessions, announce).ok()) std::abort();

  size_t at = 0;
  for (int i = 0; i < 8 && at + 3 <= size; ++i) {
    const auto& handle = fuzz::Handlers()[data[at] % fuzz::Handlers().size()];
    const size_t length = std::min<size_t>(data[at + 1] | data[at + 2] << 8, size - at - 3);
    const std::string bytes(reinterpret_cast<const char*>(data) + at + 3, length);  // NOLINT: bytes
    const absl::Status answer = handle(sessions, bytes);
    if (absl::IsInternal(answer) || absl::IsUnknown(answer) || absl::IsDataLoss(answer)) {
      // A damaged piece or archive is its sender's.
      const std::string reason = contract::ReasonOf(answer);
      if (reason != "PIECE_DAMAGED" && reason != "ARCHIVE_DAMAGED") std::abort();
    }
    at += 3 + length;
  }
  registry.WaitUntilIdle(std::chrono::seconds(10));
  return 0;
}
