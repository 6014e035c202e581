#include "server/web/upstream.h"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <mutex>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"

namespace vantage::web {
namespace {

grpc::ByteBuffer BufferOf(const std::string& message) {
  const grpc::Slice slice(message);
  return grpc::ByteBuffer(&slice, 1);
}

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  std::string bytes;
  std::vector<grpc::Slice> slices;
  if (!buffer.Valid() || !buffer.Dump(&slices).ok()) return bytes;
  bytes.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());  // NOLINT: bytes
  }
  return bytes;
}

void Prepare(grpc::ClientContext& context, const UpstreamRequest& request) {
  for (const auto& [key, value] : request.metadata) context.AddMetadata(key, value);
  if (request.timeout.has_value()) {
    context.set_deadline(std::chrono::system_clock::now() + *request.timeout);
  }
}

class UnaryUpstream final : public Upstream {
 public:
  UnaryUpstream(const std::shared_ptr<grpc::Channel>& channel, const UpstreamRequest& request)
      : stub_(channel), request_(BufferOf(request.message)) {
    Prepare(context_, request);
  }

  static void Start(const std::shared_ptr<UnaryUpstream>& call, const std::string& path,
                    std::function<void(grpc::Status, std::string)> done) {
    call->stub_.UnaryCall(&call->context_, path, grpc::StubOptions(), &call->request_,
                          &call->response_, [call, done = std::move(done)](grpc::Status status) {
                            std::string answer = status.ok() ? BytesOf(call->response_) : "";
                            call->response_.Clear();
                            done(std::move(status), std::move(answer));
                          });
  }

  void Cancel() override { context_.TryCancel(); }
  void Next() override {}

 private:
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
};

// gRPC holds it until OnDone().
class StreamUpstream final : public Upstream,
                             public grpc::ClientBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer> {
 public:
  StreamUpstream(const std::shared_ptr<grpc::Channel>& channel, const UpstreamRequest& request,
                 std::function<void(std::string)> message, std::function<void(grpc::Status)> done)
      : stub_(channel),
        request_(BufferOf(request.message)),
        message_(std::move(message)),
        done_(std::move(done)) {
    Prepare(context_, request);
  }

  static void Start(const std::shared_ptr<StreamUpstream>& call, const std::string& path) {
    call->self_ = call;
    call->stub_.PrepareBidiStreamingCall(&call->context_, path, grpc::StubOptions(), call.get());
    // Reads are asked for from outside of gRPC's own callbacks.
    call->AddHold();
    call->StartWriteLast(&call->request_, grpc::WriteOptions());
    call->StartCall();
  }

  void Next() override {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (reading_ || ended_) return;
      reading_ = true;
    }
    StartRead(&response_);
  }

  void Cancel() override {
    context_.TryCancel();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      cancelled_ = true;
      if (reading_ || ended_) return;
      ended_ = true;
    }
    RemoveHold();
  }

  void OnReadDone(bool ok) override {
    std::string message;
    if (ok) message = BytesOf(response_);
    response_.Clear();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      reading_ = false;
      // Nobody asks for another message any more.
      if (cancelled_) ok = false;
      if (!ok) ended_ = true;
    }
    if (ok) return message_(std::move(message));
    RemoveHold();
  }

  void OnDone(const grpc::Status& status) override {
    const std::shared_ptr<StreamUpstream> self = std::move(self_);
    done_(status);
    // What they hold may hold this call.
    message_ = nullptr;
    done_ = nullptr;
  }

 private:
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer response_;
  std::function<void(std::string)> message_;
  std::function<void(grpc::Status)> done_;
  std::shared_ptr<StreamUpstream> self_;
  std::mutex mutex_;
  bool reading_ ABSL_GUARDED_BY(mutex_) = false;
  bool cancelled_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
};

}  // namespace

std::shared_ptr<Upstream> CallUnary(const std::shared_ptr<grpc::Channel>& channel,
                                    const UpstreamRequest& request,
                                    std::function<void(grpc::Status, std::string)> done) {
  const auto call = std::make_shared<UnaryUpstream>(channel, request);
  UnaryUpstream::Start(call, request.path, std::move(done));
  return call;
}

std::shared_ptr<Upstream> CallStream(const std::shared_ptr<grpc::Channel>& channel,
                                     const UpstreamRequest& request,
                                     std::function<void(std::string)> message,
                                     std::function<void(grpc::Status)> done) {
  auto call =
      std::make_shared<StreamUpstream>(channel, request, std::move(message), std::move(done));
  StreamUpstream::Start(call, request.path);
  return call;
}

}  // namespace vantage::web
