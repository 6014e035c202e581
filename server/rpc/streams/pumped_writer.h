// A server stream that is pulled, never pushed: sources notify it that there is news, and the next
// message is made when the one before is written. So nothing queues up behind a slow reader. When
// there is no news for long, a heartbeat is sent.
#ifndef VANTAGE_SERVER_RPC_STREAMS_PUMPED_WRITER_H_
#define VANTAGE_SERVER_RPC_STREAMS_PUMPED_WRITER_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>
#include <new>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "server/contract/out_of_memory.h"
#include "server/conversion/to_proto.h"
#include "server/rpc/call/dependencies.h"
#include "server/rpc/call/rpc_call.h"
#include "server/rpc/call/status.h"

namespace vantage::rpc {

enum class Step {
  kIdle,       // nothing to send until notified again
  kWrite,      // send the message and come back
  kWriteLast,  // send the message and finish OK
  kFinish,     // finish with the status
};

// Derive, override Produce(), Started() and Stopped(), and make it by BeginStream(). The stream
// keeps itself alive until gRPC is done.
template <typename Response>
class PumpedWriter : public grpc::ServerWriteReactor<Response>,
                     public std::enable_shared_from_this<PumpedWriter<Response>> {
 public:
  // Notifies the stream that there may be something to send. From any thread; the caller keeps the
  // stream alive by a shared or weak pointer.
  void Notify() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (finished_) return;
      if (busy_) {
        pending_ = true;
        return;
      }
      busy_ = true;
    }
    PostPump();
  }

  void OnCancel() final {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      cancelled_ = true;
    }
    Notify();
  }
  void OnWriteDone(bool ok) final {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (!ok) cancelled_ = true;
    }
    PostPump();
  }
  void OnDone() final {
    Stopped();
    {
      std::lock_guard<std::mutex> lock(beat_mutex_);
      stopped_ = true;
      dependencies_.timer.Cancel(beat_);
    }
    self_.reset();
  }

 protected:
  PumpedWriter(const RpcDependencies& dependencies, std::shared_ptr<RpcCall> call,
               grpc::CallbackServerContext* context)
      : dependencies_(dependencies), call_(std::move(call)), context_(context) {}

  // Makes the next step, on one of our threads, one call at a time. `message` is cleared; `status`
  // is used for kFinish.
  virtual Step Produce(Response& message, absl::Status& status) = 0;
  // Is called when the stream begins: have the sources notify it.
  virtual void Started() {}
  // Is called when the stream is over: stop the sources that notify it.
  virtual void Stopped() = 0;

  const RpcDependencies dependencies_;
  const std::shared_ptr<RpcCall> call_;
  grpc::CallbackServerContext* const context_;

 private:
  template <typename Stream, typename... Args>
  friend Stream* BeginStream(Args&&... args);
  void Begin() {
    self_ = this->shared_from_this();
    Started();
    {
      std::lock_guard<std::mutex> lock(beat_mutex_);
      ArmBeat();
    }
    Notify();
  }

  void PostPump() {
    const telemetry::ScopedLogContext scope(call_->context());
    dependencies_.tasks.Post([self = this->shared_from_this()] { self->Pump(); });
  }

  // Only ever runs while busy_ is set, so one at a time; and Finish is called here only, while no
  // write is under way.
  void Pump() {
    while (true) {
      {
        std::lock_guard<std::mutex> lock(mutex_);
        pending_ = false;
        if (cancelled_) {
          finished_ = true;
        }
      }
      if (Finished()) return End(grpc::Status::CANCELLED);
      message_.Clear();
      absl::Status status = call_->StillLetIn();
      switch (status.ok() ? ProduceUnlessOutOfMemory(status) : Step::kFinish) {
        case Step::kWrite:
          TakeBeat();
          return this->StartWrite(&message_);
        case Step::kWriteLast:
          MarkFinished();
          call_->End(grpc::Status::OK);
          return this->StartWriteAndFinish(&message_, grpc::WriteOptions(), grpc::Status::OK);
        case Step::kFinish:
          MarkFinished();
          return End(ToGrpcStatus(status, *context_));
        case Step::kIdle: {
          if (TakeBeat()) {
            message_.Clear();
            *message_.mutable_heartbeat()->mutable_time() = conversion::WriteTime(absl::Now());
            return this->StartWrite(&message_);
          }
          std::lock_guard<std::mutex> lock(mutex_);
          if (!pending_ && !cancelled_) {
            busy_ = false;
            return;
          }
        }
      }
    }
  }

  Step ProduceUnlessOutOfMemory(absl::Status& status) {
    try {
      return Produce(message_, status);
    } catch (const std::bad_alloc&) {
      status = contract::OutOfMemory();
      return Step::kFinish;
    }
  }

  void ArmBeat() ABSL_EXCLUSIVE_LOCKS_REQUIRED(beat_mutex_) {
    beat_ = dependencies_.timer.After(dependencies_.heartbeat, [weak = this->weak_from_this()] {
      if (const auto stream = weak.lock()) stream->Beat();
    });
  }
  void Beat() {
    {
      std::lock_guard<std::mutex> lock(beat_mutex_);
      if (stopped_) return;
      beat_due_ = true;
      ArmBeat();
    }
    Notify();
  }
  // True when a heartbeat is due; every message that is sent counts as one.
  bool TakeBeat() {
    std::lock_guard<std::mutex> lock(beat_mutex_);
    return std::exchange(beat_due_, false);
  }

  void End(const grpc::Status& status) {
    call_->End(status);
    this->Finish(status);
  }
  bool Finished() {
    std::lock_guard<std::mutex> lock(mutex_);
    return finished_;
  }
  void MarkFinished() {
    std::lock_guard<std::mutex> lock(mutex_);
    finished_ = true;
  }

  std::mutex mutex_;
  bool busy_ ABSL_GUARDED_BY(mutex_) = false;
  bool pending_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  Response message_;  // being made or written
  std::mutex beat_mutex_;
  execution::Timer::Id beat_ ABSL_GUARDED_BY(beat_mutex_) = 0;
  bool beat_due_ ABSL_GUARDED_BY(beat_mutex_) = false;
  bool stopped_ ABSL_GUARDED_BY(beat_mutex_) = false;
  std::shared_ptr<PumpedWriter> self_;
};

// Makes a stream of these arguments, and begins it. What is returned is for gRPC, no one else.
template <typename Stream, typename... Args>
Stream* BeginStream(Args&&... args) {
  const auto stream = std::make_shared<Stream>(std::forward<Args>(args)...);
  stream->Begin();
  return stream.get();
}

// Ends at once with an error. `Reactor` is what gRPC expects of the method.
template <typename Reactor>
class RefusedStream final : public Reactor {
 public:
  RefusedStream(RpcCall& call, const absl::Status& why, grpc::CallbackServerContext* context) {
    const grpc::Status status = ToGrpcStatus(why, *context);
    call.End(status);
    this->Finish(status);
  }
  void OnDone() override { delete this; }
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_STREAMS_PUMPED_WRITER_H_
