#include <algorithm>
#include <deque>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/rpc/handlers/lookup.h"
#include "server/rpc/streams/pumped_writer.h"
#include "server/rpc/streams/streams.h"

namespace vantage::rpc {
namespace {

constexpr size_t kBatch = 32;

class SessionWatch final : public PumpedWriter<v1::WatchSessionResponse> {
 public:
  SessionWatch(const RpcDependencies& dependencies, std::shared_ptr<RpcCall> call,
               grpc::CallbackServerContext* context, std::shared_ptr<session::Session> session,
               uint64_t after)
      : PumpedWriter(dependencies, std::move(call), context),
        session_(std::move(session)),
        last_(after) {}

 protected:
  Step Produce(v1::WatchSessionResponse& message, absl::Status& status) override {
    if (resume_sent_) {
      status = contract::Retryable(absl::StatusCode::kUnavailable, "DRAINING",
                                   absl::StrCat("the server shuts down; watch again after ", last_),
                                   absl::Seconds(2));
      return Step::kFinish;
    }
    if (ahead_.empty()) {
      absl::StatusOr<std::vector<v1::SessionEvent>> events =
          session_->journal().Events(last_, kBatch);
      if (!events.ok()) {
        // Its log is gone with the session.
        status = absl::IsNotFound(events.status())
                     ? contract::ResourceNotFound("vantage/Session", SessionNameOf())
                     : events.status();
        return Step::kFinish;
      }
      ahead_.assign(std::make_move_iterator(events->begin()),
                    std::make_move_iterator(events->end()));
    }
    if (!ahead_.empty()) {
      *message.mutable_event() = std::move(ahead_.front());
      ahead_.pop_front();
      last_ = message.event().sequence();
      return Step::kWrite;
    }
    if (dependencies_.sessions.draining()) {
      message.mutable_resume()->set_after_sequence(last_);
      message.mutable_resume()->set_message("the server shuts down");
      resume_sent_ = true;
      return Step::kWrite;
    }
    return Step::kIdle;
  }

  void Started() override {
    const std::weak_ptr<PumpedWriter> self = weak_from_this();
    const auto notify = [self] {
      if (const auto stream = self.lock()) stream->Notify();
    };
    watch_ = session_->journal().Watch(notify);
    drain_ = dependencies_.sessions.WatchDrain(notify);
  }

  void Stopped() override {
    session_->journal().Unwatch(watch_);
    dependencies_.sessions.UnwatchDrain(drain_);
  }

 private:
  std::string SessionNameOf() const { return absl::StrCat("sessions/", session_->id()); }

  const std::shared_ptr<session::Session> session_;
  uint64_t last_;                       // sequence number of the last event sent
  std::deque<v1::SessionEvent> ahead_;  // read, not yet sent; at most kBatch
  bool resume_sent_ = false;
  session::Journal::WatchId watch_ = 0;
  uint64_t drain_ = 0;
};

}  // namespace

grpc::ServerWriteReactor<v1::WatchSessionResponse>* WatchSession(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::WatchSessionRequest& request) {
  using Refused = RefusedStream<grpc::ServerWriteReactor<v1::WatchSessionResponse>>;
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(call->sessions(), request.name(), "name");
  if (!session.ok()) return new Refused(*call, session.status(), context);
  const uint64_t last = (*session)->Describe().last_sequence();
  if (request.after_sequence() > last) {
    return new Refused(
        *call,
        contract::ErrorWithReason(absl::StatusCode::kOutOfRange, "SEQUENCE_AHEAD",
                                  absl::StrCat("after_sequence is ", request.after_sequence(),
                                               ", the session's last event is ", last),
                                  {{"last_sequence", absl::StrCat(last)}}),
        context);
  }
  return BeginStream<SessionWatch>(dependencies, call, context, *session, request.after_sequence());
}

}  // namespace vantage::rpc
