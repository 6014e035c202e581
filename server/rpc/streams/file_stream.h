// A file that a session is asked for, streamed as it is made.
#ifndef VANTAGE_SERVER_RPC_STREAMS_FILE_STREAM_H_
#define VANTAGE_SERVER_RPC_STREAMS_FILE_STREAM_H_

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "core/bytes/checksum.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/lookup.h"
#include "server/rpc/streams/pumped_writer.h"
#include "server/session/session.h"

namespace vantage::rpc {

// Parts are made on the planning pool, each after the one before was written, so that a slow reader
// holds one part. `Source` makes them: Next(), total_size(), model_version(), file_name() and
// session(), as session::Export has them.
template <typename Response, typename Source>
class FileStream final : public PumpedWriter<Response> {
 public:
  FileStream(const RpcDependencies& dependencies, std::shared_ptr<RpcCall> call,
             grpc::CallbackServerContext* context, std::unique_ptr<Source> source)
      : PumpedWriter<Response>(dependencies, std::move(call), context),
        source_(std::move(source)) {}

 protected:
  Step Produce(Response& message, absl::Status& status) override {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!error_.ok()) {
      status = error_;
      return Step::kFinish;
    }
    if (source_->session().closed()) {
      status = contract::ResourceNotFound("vantage/Session", source_->session().name());
      return Step::kFinish;
    }
    if (sent_ == part_.size()) {
      if (at_end_) {
        status = absl::OkStatus();
        return Step::kFinish;
      }
      if (!making_) {
        making_ = true;
        source_->session().RunInteractive(
            [self = std::static_pointer_cast<FileStream>(this->shared_from_this())](
                parallel::Parallel&) { self->MakePart(); });
      }
      return Step::kIdle;
    }
    const size_t size = std::min(kPiece, part_.size() - sent_);
    message.set_data(part_.data() + sent_, size);
    message.set_offset(offset_);
    message.set_total_size_bytes(source_->total_size());
    message.set_model_version(source_->model_version());
    message.set_crc32c(bytes::Crc32c(message.data()));
    if (offset_ == 0) message.set_file_name(source_->file_name());
    sent_ += size;
    offset_ += static_cast<int64_t>(size);
    return Step::kWrite;
  }

  void Stopped() override {}

 private:
  static constexpr size_t kPiece = 256 << 10;

  void MakePart() {
    absl::StatusOr<std::string> part =
        contract::UnlessOutOfMemory([this] { return source_->Next(); });
    {
      std::lock_guard<std::mutex> lock(mutex_);
      making_ = false;
      sent_ = 0;
      part_.clear();
      if (!part.ok()) {
        error_ = part.status();
      } else {
        at_end_ = part->empty();
        part_ = *std::move(part);
      }
    }
    this->Notify();
  }

  const std::unique_ptr<Source> source_;
  std::mutex mutex_;
  std::string part_ ABSL_GUARDED_BY(mutex_);
  size_t sent_ ABSL_GUARDED_BY(mutex_) = 0;
  int64_t offset_ ABSL_GUARDED_BY(mutex_) = 0;
  bool making_ ABSL_GUARDED_BY(mutex_) = false;
  bool at_end_ ABSL_GUARDED_BY(mutex_) = false;
  absl::Status error_ ABSL_GUARDED_BY(mutex_);
};

// Begins the stream of the file that `request` asks for, or says why there is none.
template <typename Source, typename Request, typename Response>
grpc::ServerWriteReactor<Response>* StreamFile(const RpcDependencies& dependencies,
                                               const std::shared_ptr<RpcCall>& call,
                                               grpc::CallbackServerContext* context,
                                               const Request& request) {
  using Refused = RefusedStream<grpc::ServerWriteReactor<Response>>;
  absl::Status open = dependencies.sessions.CheckTakesWork();
  if (!open.ok()) return new Refused(*call, open, context);
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(call->sessions(), request.name(), "name");
  if (!session.ok()) return new Refused(*call, session.status(), context);
  absl::Status valid = conversion::CheckRequest(request);
  if (!valid.ok()) return new Refused(*call, valid, context);
  absl::StatusOr<std::unique_ptr<Source>> source = Source::Create(*session, request);
  if (!source.ok()) return new Refused(*call, source.status(), context);
  return BeginStream<FileStream<Response, Source>>(dependencies, call, context, *std::move(source));
}

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_STREAMS_FILE_STREAM_H_
