#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/rpc/call/status.h"
#include "server/rpc/handlers/lookup.h"
#include "server/rpc/streams/streams.h"
#include "server/session/uploads.h"

namespace vantage::rpc {
namespace {

// The contract promises 5 s.
constexpr std::chrono::milliseconds kUploadHeartbeat(4000);
// A window of pieces is made durable together: when it is full, or when no piece came for a while.
constexpr std::chrono::milliseconds kWindowPause(20);

// Stores a piece on our own threads while the next one is read and decompressed, so memory is
// bounded by two messages and their contents. Syncs a window of pieces while more arrive, and
// acknowledges what is durable when the write before is done.
class UploadStream final
    : public grpc::ServerBidiReactor<v1::UploadScanRequest, v1::UploadScanResponse>,
      public std::enable_shared_from_this<UploadStream> {
 public:
  UploadStream(const RpcDependencies& dependencies, std::shared_ptr<RpcCall> call,
               grpc::CallbackServerContext* context)
      : dependencies_(dependencies), call_(std::move(call)), context_(context) {}

  void Start() {
    self_ = shared_from_this();
    drain_ = dependencies_.sessions.WatchDrain([self = weak_from_this()] {
      if (const auto stream = self.lock()) stream->Drain();
    });
    {
      std::lock_guard<std::mutex> lock(mutex_);
      Arm();
    }
    StartNextRead();
    if (dependencies_.sessions.draining()) Drain();
  }

  void OnReadDone(bool ok) override {
    const telemetry::ScopedLogContext scope(call_->context());
    if (ok) {
      dependencies_.tasks.Post([self = shared_from_this()] { self->Unpack(); });
      return;
    }
    {
      std::lock_guard<std::mutex> lock(mutex_);
      ended_ = true;
      if (taking_) return;
      taking_ = true;
    }
    dependencies_.tasks.Post([self = shared_from_this()] { self->TakeNext(); });
  }

  void OnWriteDone(bool ok) override {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      writing_ = false;
      if (!ok && !concluded_) {
        concluded_ = true;
        verdict_ = absl::CancelledError("the link is gone");
      }
    }
    Advance();
  }

  void OnCancel() override { Conclude(absl::CancelledError("cancelled by the client")); }

  void OnDone() override {
    dependencies_.sessions.UnwatchDrain(drain_);
    {
      std::lock_guard<std::mutex> lock(mutex_);
      dependencies_.timer.Cancel(timer_);
      dependencies_.timer.Cancel(pause_);
    }
    self_.reset();
  }

 private:
  struct Message {
    v1::UploadScanRequest request;
    std::optional<session::UnpackedPiece> piece;
  };

  // Decompresses the message that was read; it is stored when those before it are.
  void Unpack() {
    if (reading_->request.has_piece()) {
      reading_->piece.emplace(reading_->request.piece(),
                              dependencies_.sessions.dependencies().limits);
    }
    {
      std::lock_guard<std::mutex> lock(mutex_);
      next_ = std::move(reading_);
      if (taking_) return;
      taking_ = true;
    }
    TakeNext();
  }

  void TakeNext() {
    std::unique_ptr<Message> message;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (concluded_) return;
      message = std::move(next_);
    }
    if (message == nullptr) {
      // The client has finished sending. What it sent stays, and it can go on with another stream.
      SyncWindow();
      Conclude(absl::OkStatus());
      return;
    }
    StartNextRead();
    Take(*message);
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (next_ == nullptr && !ended_) {
        taking_ = false;
        return;
      }
    }
    const telemetry::ScopedLogContext scope(call_->context());
    dependencies_.tasks.Post([self = shared_from_this()] { self->TakeNext(); });
  }

  void Take(const Message& message) {
    absl::StatusOr<v1::Upload> upload = Store(message);
    if (!upload.ok()) return Conclude(upload.status());
    const bool ended = upload->state() != v1::UPLOAD_STATE_OPEN;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (ended || latest_.credit_offset() == 0) Acknowledge(*upload);
    }
    if (ended) return Conclude(absl::OkStatus());
    if (upload_->WindowFull()) {
      PostSync();
    } else if (upload_->UnsyncedBytes() > 0) {
      std::lock_guard<std::mutex> lock(mutex_);
      if (pause_ == 0) {
        pause_ = dependencies_.timer.After(kWindowPause, [self = weak_from_this()] {
          if (const auto stream = self.lock()) stream->PostSync();
        });
      }
    }
    Advance();
  }

  // One sync at a time; pieces that arrive meanwhile are in the next one.
  void PostSync() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (pause_ != 0) dependencies_.timer.Cancel(pause_);
      pause_ = 0;
      if (finished_) return;
      if (syncing_) {
        sync_again_ = true;
        return;
      }
      syncing_ = true;
    }
    const telemetry::ScopedLogContext scope(call_->context());
    dependencies_.tasks.Post([self = shared_from_this()] {
      self->SyncWindow();
      bool again = false;
      {
        std::lock_guard<std::mutex> lock(self->mutex_);
        self->syncing_ = false;
        std::swap(again, self->sync_again_);
      }
      if (again) self->PostSync();
    });
  }

  void SyncWindow() {
    if (!upload_.has_value()) return;
    absl::StatusOr<v1::Upload> upload = upload_->Sync();
    if (!upload.ok()) return Conclude(upload.status());
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (latest_.state() <= v1::UPLOAD_STATE_OPEN) Acknowledge(*upload);
    }
    Advance();
  }

  void StartNextRead() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (finished_) return;
      starting_read_ = true;  // nobody finishes the stream between here and the read
    }
    reading_ = std::make_unique<Message>();
    StartRead(&reading_->request);
    {
      std::lock_guard<std::mutex> lock(mutex_);
      starting_read_ = false;
    }
    Advance();
  }

  absl::StatusOr<v1::Upload> Store(const Message& message) {
    if (absl::Status let_in = call_->StillLetIn(); !let_in.ok()) return let_in;
    const v1::UploadScanRequest& request = message.request;
    if (!upload_.has_value()) {
      call_->Concerns(request);
      absl::StatusOr<std::shared_ptr<session::Session>> session =
          FindParent(call_->sessions(), request.upload(), "uploads", "upload");
      if (!session.ok()) return session.status();
      session_ = *session;
      upload_ = session_->uploads().Hold(request.upload());
    } else if (!request.upload().empty() && request.upload() != upload_->name()) {
      return contract::InvalidField("upload",
                                    "must be empty or the same in every message of a stream");
    }
    return upload_->Take(message.piece.has_value() ? &*message.piece : nullptr,
                         request.has_total() ? &request.total() : nullptr);
  }

  void Acknowledge(const v1::Upload& upload) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    latest_.set_next_sequence(upload.next_sequence());
    latest_.set_next_offset(upload.next_offset());
    latest_.set_credit_offset(upload.credit_offset());
    latest_.set_state(upload.state());
    latest_.set_state_message(upload.state_message());
    latest_.set_scan(upload.scan());
    unsent_ = true;
  }

  void Drain() {
    Conclude(contract::Retryable(absl::StatusCode::kUnavailable, "DRAINING",
                                 "the server shuts down; GetUpload says from where to go on",
                                 absl::Seconds(2)));
  }

  // Only the first outcome counts.
  void Conclude(absl::Status verdict) {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (!concluded_) {
        concluded_ = true;
        verdict_ = std::move(verdict);
      }
    }
    Advance();
  }

  // Writes the latest acknowledgement, or finishes, when no write is under way.
  void Advance() {
    bool write = false;
    grpc::Status status;
    absl::Status outcome;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (writing_ || finished_ || starting_read_) return;
      write = unsent_ && !absl::IsCancelled(verdict_);
      if (write) {
        writing_ = true;
        unsent_ = false;
        response_ = latest_;
        *response_.mutable_time() = conversion::WriteTime(absl::Now());
      } else if (concluded_) {
        finished_ = true;
        outcome = verdict_;
        status = ToGrpcStatus(outcome, *context_);
      } else {
        return;
      }
    }
    if (write) return StartWrite(&response_);
    call_->Audit(outcome);
    call_->End(status);
    Finish(status);
  }

  void Arm() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    const auto silence = std::min(dependencies_.heartbeat, kUploadHeartbeat);
    timer_ = dependencies_.timer.After(silence, [self = weak_from_this()] {
      if (const auto stream = self.lock()) stream->Beat();
    });
  }
  void Beat() {
    // Whoever sends nothing is not asked by Store().
    if (absl::Status let_in = call_->StillLetIn(); !let_in.ok()) return Conclude(let_in);
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (finished_) return;
      unsent_ = true;  // before the first message it tells only the time
      Arm();
    }
    Advance();
  }

  const RpcDependencies dependencies_;
  const std::shared_ptr<RpcCall> call_;
  grpc::CallbackServerContext* const context_;
  std::shared_ptr<UploadStream> self_;
  uint64_t drain_ = 0;
  std::unique_ptr<Message> reading_;  // gRPC's, then Unpack()'s
  std::shared_ptr<session::Session> session_;
  std::optional<session::HeldUpload> upload_;  // of the session, from the first message on

  std::mutex mutex_;
  v1::UploadScanResponse latest_ ABSL_GUARDED_BY(mutex_);
  v1::UploadScanResponse response_;                        // being written
  std::unique_ptr<Message> next_ ABSL_GUARDED_BY(mutex_);  // to be taken
  bool taking_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;  // no more messages are read
  bool unsent_ ABSL_GUARDED_BY(mutex_) = false;
  bool writing_ ABSL_GUARDED_BY(mutex_) = false;
  bool starting_read_ ABSL_GUARDED_BY(mutex_) = false;
  bool concluded_ ABSL_GUARDED_BY(mutex_) = false;
  bool finished_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status verdict_ ABSL_GUARDED_BY(mutex_);
  bool syncing_ ABSL_GUARDED_BY(mutex_) = false;
  bool sync_again_ ABSL_GUARDED_BY(mutex_) = false;
  execution::Timer::Id timer_ ABSL_GUARDED_BY(mutex_) = 0;
  execution::Timer::Id pause_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace

grpc::ServerBidiReactor<v1::UploadScanRequest, v1::UploadScanResponse>* UploadScan(
    const RpcDependencies& dependencies, const std::shared_ptr<RpcCall>& call,
    grpc::CallbackServerContext* context) {
  auto stream = std::make_shared<UploadStream>(dependencies, call, context);
  stream->Start();
  return stream.get();
}

}  // namespace vantage::rpc
