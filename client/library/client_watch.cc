// Streams from the server that outlive their links: session events, plans, exports.
#include <memory>

#include "absl/strings/str_cat.h"
#include "client/library/client.h"
#include "client/library/loading_wait.h"
#include "client/library/resource_names.h"
#include "client/library/resumption.h"
#include "client/library/wire.h"
#include "core/bytes/checksum.h"

namespace vantage::client {
namespace {

// The scan that an event concerns, if any.
const v1::Scan* ScanOf(const v1::SessionEvent& event) {
  switch (event.event_case()) {
    case v1::SessionEvent::kScanReceived:
      return &event.scan_received().scan();
    case v1::SessionEvent::kScanReplaced:
      return &event.scan_replaced().scan();
    case v1::SessionEvent::kScanRegistered:
      return &event.scan_registered().scan();
    case v1::SessionEvent::kScanRefused:
      return &event.scan_refused().scan();
    case v1::SessionEvent::kScanAccepted:
      return &event.scan_accepted().scan();
    case v1::SessionEvent::kScanPoseSet:
      return &event.scan_pose_set().scan();
    case v1::SessionEvent::kScanMerged:
      return &event.scan_merged().scan();
    case v1::SessionEvent::kScanWithdrawn:
      return &event.scan_withdrawn().scan();
    case v1::SessionEvent::kScanRemoved:
      return &event.scan_removed().scan();
    default:
      return nullptr;
  }
}

// Hands a streamed file to `sink`, piece by piece, each checked against its checksum and place.
template <typename Response>
absl::StatusOr<std::string> ReceiveFile(const Wire& wire, grpc::ClientContext& context,
                                        std::unique_ptr<grpc::ClientReader<Response>> stream,
                                        absl::FunctionRef<absl::Status(absl::string_view)> sink,
                                        absl::FunctionRef<void(const ExportProgress&)> progress) {
  Response response;
  std::string file_name;
  int64_t received = 0;
  int64_t announced = 0;
  absl::Status refused;
  while (stream->Read(&response)) {
    if (!refused.ok() || response.has_heartbeat()) continue;
    if (response.offset() != received || bytes::Crc32c(response.data()) != response.crc32c()) {
      refused = absl::DataLossError(
          absl::StrCat("the export was damaged on its way, after ", received, " bytes"));
      context.TryCancel();
      continue;
    }
    received += static_cast<int64_t>(response.data().size());
    if (response.total_size_bytes() > 0) announced = response.total_size_bytes();
    if (!response.file_name().empty()) file_name = response.file_name();
    progress({received, announced});
    if (refused = sink(response.data()); !refused.ok()) context.TryCancel();
  }
  const grpc::Status status = stream->Finish();
  if (!refused.ok()) return refused;
  if (!status.ok()) return wire.Failure(status);
  if (announced > 0 && announced != received) {
    return absl::DataLossError(
        absl::StrCat("the export ended after ", received, " of ", announced, " bytes"));
  }
  return file_name;
}

// All of a file in memory; `receive` is called with a sink, again after a break.
template <typename Receive>
absl::StatusOr<std::string> WholeFile(const Wire& wire, const Receive& receive) {
  Resumption resumption(wire);
  while (true) {
    std::string bytes;
    const auto sink = [&bytes](absl::string_view piece) {
      bytes.append(piece.data(), piece.size());
      return absl::OkStatus();
    };
    const auto name = receive(absl::FunctionRef<absl::Status(absl::string_view)>(sink));
    if (name.ok()) return bytes;
    if (absl::Status resumed = resumption.AfterBreak(name.status()); !resumed.ok()) return resumed;
  }
}

}  // namespace

absl::Status Client::WatchSession(const std::string& session, uint64_t after_sequence,
                                  absl::FunctionRef<bool(const v1::SessionEvent&)> on_event) {
  Resumption resumption(*wire_);
  uint64_t last = after_sequence;
  while (true) {
    v1::WatchSessionRequest request;
    request.set_name(session);
    request.set_after_sequence(last);
    grpc::ClientContext context;
    if (absl::Status prepared = wire_->Prepare(context); !prepared.ok()) return prepared;
    auto stream = wire_->sessions->WatchSession(&context, request);
    v1::WatchSessionResponse response;
    while (stream->Read(&response)) {
      resumption.Progress();
      if (!response.has_event()) continue;
      if (response.event().sequence() <= last) continue;
      last = response.event().sequence();
      if (!on_event(response.event())) {
        context.TryCancel();
        while (stream->Read(&response)) {
        }
        stream->Finish().ok();
        return absl::OkStatus();
      }
    }
    const grpc::Status status = stream->Finish();
    const absl::Status ended = status.ok() ? absl::UnavailableError("the server closed the watch")
                                           : wire_->Failure(status);
    if (absl::Status resumed = resumption.AfterBreak(ended); !resumed.ok()) return resumed;
  }
}

absl::StatusOr<ServerTime> Client::ReadServerTime(const std::string& session,
                                                  uint64_t after_sequence) {
  v1::WatchSessionRequest request;
  request.set_name(session);
  request.set_after_sequence(after_sequence);
  grpc::ClientContext context;
  // A heartbeat comes after 15 s of silence at the latest.
  context.set_deadline(DeadlineIn(20));
  if (absl::Status prepared = wire_->Prepare(context); !prepared.ok()) return prepared;
  const auto stream = wire_->sessions->WatchSession(&context, request);
  v1::WatchSessionResponse response;
  ServerTime time;
  bool read = false;
  while (!read && stream->Read(&response)) {
    if (!response.has_heartbeat() || !response.heartbeat().has_time()) continue;
    time.here = std::chrono::system_clock::now();
    time.there = std::chrono::system_clock::time_point(
        std::chrono::seconds(response.heartbeat().time().seconds()) +
        std::chrono::duration_cast<std::chrono::system_clock::duration>(
            std::chrono::nanoseconds(response.heartbeat().time().nanos())));
    read = true;
  }
  context.TryCancel();
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  if (read) return time;
  return status.ok() ? absl::UnavailableError("the server closed the watch")
                     : wire_->Failure(status);
}

absl::StatusOr<v1::Scan> Client::WaitForScan(const std::string& name,
                                             absl::FunctionRef<void(const v1::Scan&)> on_state) {
  // The session is read first: later changes of the scan arrive as events.
  v1::GetSessionRequest get_session;
  get_session.set_name(SessionOf(name));
  const auto session = Call(get_session);
  if (!session.ok()) return session.status();
  v1::GetScanRequest get_scan;
  get_scan.set_name(name);
  const auto scan = Call(get_scan);
  if (!scan.ok()) return scan.status();
  v1::Scan latest = scan->scan();
  on_state(latest);
  if (IsDecided(latest.state())) return latest;
  const absl::Status watched = WatchSession(SessionOf(name), session->session().last_sequence(),
                                            [&](const v1::SessionEvent& event) {
                                              const v1::Scan* changed = ScanOf(event);
                                              if (changed == nullptr || changed->name() != name)
                                                return true;
                                              latest = *changed;
                                              on_state(latest);
                                              return !IsDecided(latest.state());
                                            });
  if (!watched.ok()) return watched;
  return latest;
}

absl::StatusOr<v1::Plan> Client::WatchPlan(const std::string& name,
                                           absl::FunctionRef<void(const v1::Plan&)> on_revision) {
  Resumption resumption(*wire_);
  v1::Plan latest;
  while (true) {
    v1::WatchPlanRequest request;
    request.set_name(name);
    request.set_after_revision(latest.revision());
    grpc::ClientContext context;
    if (absl::Status prepared = wire_->Prepare(context); !prepared.ok()) return prepared;
    auto stream = wire_->plans->WatchPlan(&context, request);
    v1::WatchPlanResponse response;
    while (stream->Read(&response)) {
      resumption.Progress();
      if (!response.has_plan()) continue;  // a heartbeat
      latest = response.plan();
      on_revision(latest);
    }
    const grpc::Status status = stream->Finish();
    if (HasEnded(latest.state())) return latest;
    const absl::Status ended = status.ok() ? absl::UnavailableError("the server closed the watch")
                                           : wire_->Failure(status);
    if (absl::Status resumed = resumption.AfterBreak(ended); !resumed.ok()) return resumed;
  }
}

absl::StatusOr<v1::Tour> Client::CreateTour(const v1::CreateTourRequest& request,
                                            absl::FunctionRef<void(const v1::Tour&)> on_tour) {
  Resumption resumption(*wire_);
  while (true) {
    grpc::ClientContext context;
    if (absl::Status prepared = wire_->Prepare(context); !prepared.ok()) return prepared;
    auto stream = wire_->plans->CreateTour(&context, request);
    v1::CreateTourResponse response;
    v1::Tour latest;
    bool last = false;
    while (stream->Read(&response)) {
      resumption.Progress();
      if (!response.has_tour()) continue;  // a heartbeat
      latest = response.tour();
      last = response.last();
      on_tour(latest);
    }
    const grpc::Status status = stream->Finish();
    if (last) return latest;
    const absl::Status ended =
        status.ok() ? absl::UnavailableError("the server closed the tour") : wire_->Failure(status);
    if (absl::Status resumed = resumption.AfterBreak(ended); !resumed.ok()) return resumed;
  }
}

absl::StatusOr<v1::Plan> Client::GetFullPlan(const std::string& name) {
  v1::GetPlanRequest request;
  request.set_name(name);
  request.set_view(v1::PLAN_VIEW_FULL);
  auto first = Call(request);
  if (!first.ok()) return first.status();
  v1::Plan plan = std::move(*first->mutable_plan());
  v1::ScoreMap& map = *plan.mutable_result()->mutable_score_map();
  std::string token = first->next_score_map_page_token();
  while (!token.empty()) {
    request.set_score_map_page_token(token);
    const auto page = Call(request);
    if (!page.ok()) return page.status();
    const v1::ScoreMap& more = page->plan().result().score_map();
    map.mutable_x()->MergeFrom(more.x());
    map.mutable_y()->MergeFrom(more.y());
    map.mutable_z()->MergeFrom(more.z());
    map.mutable_score()->MergeFrom(more.score());
    map.mutable_score_lower()->MergeFrom(more.score_lower());
    map.mutable_score_upper()->MergeFrom(more.score_upper());
    token = page->next_score_map_page_token();
  }
  return plan;
}

absl::StatusOr<std::string> Client::Export(
    const v1::ExportModelRequest& request, absl::FunctionRef<absl::Status(absl::string_view)> sink,
    absl::FunctionRef<void(const ExportProgress&)> progress) {
  LoadingWait loading(wire_->options);
  while (true) {
    ExportProgress reached;
    absl::StatusOr<std::string> name = ExportOnce(request, sink, [&](const ExportProgress& p) {
      reached = p;
      progress(p);
    });
    // Nothing came before the model was there.
    if (name.ok() || reached.received_bytes > 0 || !loading.After(name.status())) return name;
  }
}

absl::StatusOr<std::string> Client::ExportOnce(
    const v1::ExportModelRequest& request, absl::FunctionRef<absl::Status(absl::string_view)> sink,
    absl::FunctionRef<void(const ExportProgress&)> progress) {
  grpc::ClientContext context;
  if (absl::Status prepared = wire_->Prepare(context); !prepared.ok()) return prepared;
  return ReceiveFile(*wire_, context, wire_->model->ExportModel(&context, request), sink, progress);
}

absl::StatusOr<std::string> Client::ExportBytes(const v1::ExportModelRequest& request) {
  return WholeFile(*wire_,
                   [&](auto sink) { return Export(request, sink, [](const ExportProgress&) {}); });
}

absl::StatusOr<std::string> Client::ExportBytes(const v1::ExportReportRequest& request) {
  const auto receive = [&](auto sink) -> absl::StatusOr<std::string> {
    LoadingWait loading(wire_->options);
    while (true) {
      grpc::ClientContext context;
      if (absl::Status prepared = wire_->Prepare(context); !prepared.ok()) return prepared;
      // A server that has to load the model says so before anything comes.
      absl::StatusOr<std::string> page =
          ReceiveFile(*wire_, context, wire_->model->ExportReport(&context, request), sink,
                      [](const ExportProgress&) {});
      if (page.ok() || !loading.After(page.status())) return page;
    }
  };
  return WholeFile(*wire_, receive);
}

}  // namespace vantage::client
