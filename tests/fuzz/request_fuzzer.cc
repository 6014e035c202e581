#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <future>
#include <string>
#include <vector>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"
#include "server/session/error.h"
#include "server/session/export.h"
#include "server/session/session_registry.h"
#include "server/store/memory_store.h"

namespace vantage {
namespace {

// Algorithms that refuse: what is looked at is what comes before them.
Algorithms Refusing() {
  const absl::Status no = absl::FailedPreconditionError("not here");
  Algorithms algorithms;
  algorithms.level = [no](const Scan&) -> absl::StatusOr<Levelling> { return no; };
  algorithms.register_scan = [no](const PlanningView&, const Scan&, const PosePrior&,
                                  std::span<const TargetTie>, const RegistrationConfig&,
                                  Parallel&) -> absl::StatusOr<RegistrationResult> { return no; };
  algorithms.make_plan = [no](const PlanningView&, const ScannerModel&, const PlanningConfig&,
                              const Budget&, Parallel&,
                              PlanProgress) -> absl::StatusOr<Plan> { return no; };
  algorithms.evaluate_view = [no](const PlanningView&, const ScannerModel&, const PlanningConfig&,
                                  const Eigen::Vector3d&,
                                  Parallel&) -> absl::StatusOr<ViewEvaluation> { return no; };
  algorithms.measure_coverage = [](const PlanningView&, const PlanningConfig&) {
    return Coverage();
  };
  return algorithms;
}

using Handle = std::function<absl::Status(const TenantSessions&, const std::string&)>;

template <typename Request, typename Response>
Handle Of(absl::StatusOr<Response> (*handler)(const TenantSessions&, const Request&)) {
  return [handler](const TenantSessions& sessions, const std::string& bytes) -> absl::Status {
    Request request;
    if (!request.ParseFromString(bytes)) return absl::OkStatus();
    return handler(sessions, request).status();
  };
}

// Of a handler that answers later, on another thread.
template <typename Request, typename Response>
Handle Of(void (*handler)(const TenantSessions&, const Request&,
                          std::function<void(absl::StatusOr<Response>)>)) {
  return [handler](const TenantSessions& sessions, const std::string& bytes) -> absl::Status {
    Request request;
    if (!request.ParseFromString(bytes)) return absl::OkStatus();
    std::promise<absl::Status> answer;
    handler(sessions, request,
            [&](absl::StatusOr<Response> response) { answer.set_value(response.status()); });
    return answer.get_future().get();
  };
}

absl::Status ExportAll(const TenantSessions& sessions, const std::string& bytes) {
  v1::ExportModelRequest request;
  if (!request.ParseFromString(bytes)) return absl::OkStatus();
  const auto session = FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  const auto source = Export::Create(*session, request);
  if (!source.ok()) return source.status();
  while (true) {
    const absl::StatusOr<std::string> part = (*source)->Next();
    if (!part.ok() || part->empty()) return part.status();
  }
}

const std::vector<Handle>& Handlers() {
  static const auto& all = *new std::vector<Handle>{
      Of(handlers::CreateSession), Of(handlers::GetSession),    Of(handlers::ListSessions),
      Of(handlers::UpdateSession), Of(handlers::DeleteSession), Of(handlers::CreateUpload),
      Of(handlers::GetUpload),     Of(handlers::UploadPiece),   Of(handlers::GetScan),
      Of(handlers::ListScans),     Of(handlers::AcceptScan),    Of(handlers::SetScanPose),
      Of(handlers::WithdrawScan),  Of(handlers::CreatePlan),    Of(handlers::GetPlan),
      Of(handlers::ListPlans),     Of(handlers::CancelPlan),    Of(handlers::RejectView),
      Of(handlers::GetCoverage),   Of(handlers::AddScanner),    Of(handlers::ListScanners),
      Of(handlers::RenewClaim),    Of(handlers::ReleaseClaim),  Of(handlers::ListClaims),
      Of(handlers::ClaimView),     Of(handlers::EvaluateView),  ExportAll,
  };
  return all;
}

}  // namespace
}  // namespace vantage

// Several requests, one after the other, to a server that has one session with an upload: a byte
// for the method, two for the length, the message. Each is answered with a canonical code that
// blames nobody's programming.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace vantage;  // NOLINT: the entry point's name is not ours
  static Log& log = *new Log(LogLevel::kOff, Log::Stderr());
  static Timer& timer = *new Timer();
  static PlanningPool& pool = *new PlanningPool(1, 2);
  MemoryStore store(size_t{64} << 20);
  SessionRegistry registry(SessionSurroundings{store, pool, timer, log, Limits(), Refusing(), [] {
                                                 return absl::FromUnixSeconds(1'700'000'000);
                                               }});
  const TenantSessions sessions(registry, "tenant");
  v1::CreateSessionRequest create;
  create.set_session_id("job");
  if (!handlers::CreateSession(sessions, create).ok()) std::abort();
  v1::CreateUploadRequest announce;
  announce.set_parent("sessions/job");
  if (!handlers::CreateUpload(sessions, announce).ok()) std::abort();

  size_t at = 0;
  for (int i = 0; i < 8 && at + 3 <= size; ++i) {
    const auto& handle = Handlers()[data[at] % Handlers().size()];
    const size_t length = std::min<size_t>(data[at + 1] | data[at + 2] << 8, size - at - 3);
    const std::string bytes(reinterpret_cast<const char*>(data) + at + 3, length);  // NOLINT: bytes
    const absl::Status answer = handle(sessions, bytes);
    if (absl::IsInternal(answer) || absl::IsUnknown(answer) || absl::IsDataLoss(answer)) {
      // A damaged piece is its sender's.
      if (ReasonOf(answer) != "PIECE_DAMAGED") std::abort();
    }
    at += 3 + length;
  }
  registry.WaitUntilIdle(std::chrono::seconds(10));
  return 0;
}
