#include <algorithm>
#include <deque>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/rpc/lookup.h"
#include "server/rpc/pumped_writer.h"
#include "server/rpc/streams.h"
#include "server/session/error.h"
#include "server/session/to_proto.h"

namespace vantage {
namespace {

constexpr std::chrono::seconds kWatchHeartbeat(10);
constexpr size_t kBatch = 32;

class SessionWatch final : public PumpedWriter<v1::WatchSessionResponse> {
 public:
  SessionWatch(const RpcEnvironment& around, std::shared_ptr<RpcCall> call,
               grpc::CallbackServerContext* context, std::shared_ptr<Session> session,
               uint64_t after)
      : PumpedWriter(around, std::move(call), context),
        session_(std::move(session)),
        last_(after) {}

  void Start() {
    const std::weak_ptr<PumpedWriter> self = weak_from_this();
    const auto notify = [self] {
      if (const auto stream = self.lock()) stream->Notify();
    };
    watch_ = session_->journal().Watch(notify);
    drain_ = around_.sessions.WatchDrain(notify);
    {
      std::lock_guard<std::mutex> lock(timer_mutex_);
      Arm();
    }
    Begin();
  }

 protected:
  Step Produce(v1::WatchSessionResponse& message, absl::Status& status) override {
    if (resume_sent_) {
      status = Retryable(absl::StatusCode::kUnavailable, "DRAINING",
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
                     ? ResourceNotFound("vantage.v1.Session", SessionNameOf())
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
      TakeBeat();
      return Step::kWrite;
    }
    if (around_.sessions.draining()) {
      message.mutable_resume()->set_after_sequence(last_);
      message.mutable_resume()->set_reason("the server shuts down");
      resume_sent_ = true;
      return Step::kWrite;
    }
    if (TakeBeat()) {
      *message.mutable_heartbeat()->mutable_time() = WriteTime(absl::Now());
      message.mutable_heartbeat()->set_last_sequence(last_);
      return Step::kWrite;
    }
    return Step::kIdle;
  }

  void Stopped() override {
    session_->journal().Unwatch(watch_);
    around_.sessions.UnwatchDrain(drain_);
    std::lock_guard<std::mutex> lock(timer_mutex_);
    stopped_ = true;
    around_.timer.Cancel(timer_);
  }

 private:
  std::string SessionNameOf() const { return absl::StrCat("sessions/", session_->id()); }

  void Arm() ABSL_EXCLUSIVE_LOCKS_REQUIRED(timer_mutex_) {
    timer_ = around_.timer.After(kWatchHeartbeat, [self = weak_from_this()] {
      if (const auto stream = self.lock()) static_cast<SessionWatch&>(*stream).Beat();
    });
  }
  void Beat() {
    {
      std::lock_guard<std::mutex> lock(timer_mutex_);
      if (stopped_) return;
      beat_due_ = true;
      Arm();
    }
    Notify();
  }
  // Whether a heartbeat is due; anything that is sent stands for one.
  bool TakeBeat() {
    std::lock_guard<std::mutex> lock(timer_mutex_);
    return std::exchange(beat_due_, false);
  }

  const std::shared_ptr<Session> session_;
  uint64_t last_;                       // sequence number of the last event sent
  std::deque<v1::SessionEvent> ahead_;  // read, not yet sent; at most kBatch
  bool resume_sent_ = false;
  Journal::WatchId watch_ = 0;
  uint64_t drain_ = 0;
  std::mutex timer_mutex_;
  Timer::Id timer_ ABSL_GUARDED_BY(timer_mutex_) = 0;
  bool beat_due_ ABSL_GUARDED_BY(timer_mutex_) = false;
  bool stopped_ ABSL_GUARDED_BY(timer_mutex_) = false;
};

}  // namespace

grpc::ServerWriteReactor<v1::WatchSessionResponse>* WatchSession(
    const RpcEnvironment& around, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context, const v1::WatchSessionRequest& request) {
  using Refused = RefusedStream<grpc::ServerWriteReactor<v1::WatchSessionResponse>>;
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindSession(call->sessions(), request.name(), "name");
  if (!session.ok()) return new Refused(*call, session.status(), context);
  const uint64_t last = (*session)->Describe().last_sequence();
  if (request.after_sequence() > last) {
    return new Refused(*call,
                       ErrorWithReason(absl::StatusCode::kOutOfRange, "SEQUENCE_AHEAD",
                                       absl::StrCat("after_sequence is ", request.after_sequence(),
                                                    ", the session's last event is ", last),
                                       {{"last_sequence", absl::StrCat(last)}}),
                       context);
  }
  auto watch =
      std::make_shared<SessionWatch>(around, call, context, *session, request.after_sequence());
  watch->Start();
  return watch.get();
}

}  // namespace vantage
