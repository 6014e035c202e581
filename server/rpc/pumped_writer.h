// A server stream that is pulled, never pushed: whoever has news says so, and the next message is
// made when the one before is written. Nothing queues up behind a slow reader.
#ifndef VANTAGE_SERVER_RPC_PUMPED_WRITER_H_
#define VANTAGE_SERVER_RPC_PUMPED_WRITER_H_

#include <grpcpp/grpcpp.h>

#include <memory>
#include <mutex>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "server/rpc/environment.h"
#include "server/rpc/rpc_call.h"
#include "server/rpc/status.h"

namespace vantage {

enum class Step {
  kIdle,       // nothing to send until notified again
  kWrite,      // send the message and come back
  kWriteLast,  // send the message and finish OK
  kFinish,     // finish with the status
};

// Derive, override Produce() and Stopped(), and call Begin(). Keeps itself until gRPC is done.
template <typename Response>
class PumpedWriter : public grpc::ServerWriteReactor<Response>,
                     public std::enable_shared_from_this<PumpedWriter<Response>> {
 public:
  // Something may be there to send. Any thread; keep-alive by shared or weak pointer is the
  // caller's business.
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
    self_.reset();
  }

 protected:
  PumpedWriter(const RpcEnvironment& around, std::shared_ptr<RpcCall> call,
               grpc::CallbackServerContext* context)
      : around_(around), call_(std::move(call)), context_(context) {}

  // Once, after construction; the stream lives on by itself.
  void Begin() {
    self_ = this->shared_from_this();
    Notify();
  }

  // The next step, on one of our threads, one call at a time. `message` is cleared; `status` counts
  // for kFinish.
  virtual Step Produce(Response& message, absl::Status& status) = 0;
  // The stream is over: stop what notifies it.
  virtual void Stopped() = 0;

  const RpcEnvironment around_;
  const std::shared_ptr<RpcCall> call_;
  grpc::CallbackServerContext* const context_;

 private:
  void PostPump() {
    const ScopedLogContext scope(call_->context());
    around_.tasks.Post([self = this->shared_from_this()] { self->Pump(); });
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
      switch (status.ok() ? Produce(message_, status) : Step::kFinish) {
        case Step::kWrite:
          return this->StartWrite(&message_);
        case Step::kWriteLast:
          MarkFinished();
          call_->End(grpc::Status::OK);
          return this->StartWriteAndFinish(&message_, grpc::WriteOptions(), grpc::Status::OK);
        case Step::kFinish:
          MarkFinished();
          return End(ToGrpcStatus(status, *context_));
        case Step::kIdle: {
          std::lock_guard<std::mutex> lock(mutex_);
          if (!pending_ && !cancelled_) {
            busy_ = false;
            return;
          }
        }
      }
    }
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
  std::shared_ptr<PumpedWriter> self_;
};

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

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_PUMPED_WRITER_H_
