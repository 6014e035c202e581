// A unary RPC whose handler runs on our own threads.
#ifndef VANTAGE_SERVER_RPC_UNARY_CALL_H_
#define VANTAGE_SERVER_RPC_UNARY_CALL_H_

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "server/rpc/environment.h"
#include "server/rpc/status.h"
#include "server/session/error.h"

namespace vantage {

// Keeps itself until gRPC is done with it and no handler refers to it any more. The handler works
// on a copy of the request and its answer is moved in under a claim, so a call that was cancelled
// meanwhile finishes at once and is never touched again.
template <typename Request, typename Response>
class UnaryCall final : public grpc::ServerUnaryReactor,
                        public std::enable_shared_from_this<UnaryCall<Request, Response>> {
 public:
  using Answer = absl::StatusOr<Response>;
  using Done = std::function<void(Answer)>;
  using AsyncHandler = std::function<void(SessionRegistry&, const Request&, Done)>;
  using Handler = Answer (*)(SessionRegistry&, const Request&);

  // `handler` calls its last argument exactly once, on any thread.
  static grpc::ServerUnaryReactor* Start(const RpcEnvironment& around, const char* method,
                                         grpc::CallbackServerContext* context,
                                         const Request* request, Response* response,
                                         AsyncHandler handler) {
    std::shared_ptr<UnaryCall> call(new UnaryCall(around, method, context, response));
    call->self_ = call;
    const bool posted = around.tasks.TryPost([call, copy = *request, handler = std::move(handler)] {
      if (call->finished_) return;  // cancelled while it waited
      handler(call->around_.sessions, copy,
              [call](Answer answer) { call->Complete(std::move(answer)); });
    });
    if (!posted) {
      call->Complete(Retryable(absl::StatusCode::kResourceExhausted, "SERVER_BUSY",
                               "too many requests wait; try again", absl::Milliseconds(500)));
    }
    return call.get();
  }

  static grpc::ServerUnaryReactor* Start(const RpcEnvironment& around, const char* method,
                                         grpc::CallbackServerContext* context,
                                         const Request* request, Response* response,
                                         Handler handler) {
    return Start(around, method, context, request, response,
                 [handler](SessionRegistry& sessions, const Request& asked, const Done& done) {
                   done(handler(sessions, asked));
                 });
  }

  void OnCancel() override {
    if (!finished_.exchange(true)) Finish(grpc::Status::CANCELLED);
  }
  void OnDone() override { self_.reset(); }

 private:
  UnaryCall(const RpcEnvironment& around, const char* method, grpc::CallbackServerContext* context,
            Response* response)
      : around_(around), method_(method), context_(context), response_(response) {}

  void Complete(Answer answer) {
    if (finished_.exchange(true)) return;
    const grpc::Status status = ToGrpcStatus(answer.status(), *context_);
    if (answer.ok()) *response_ = *std::move(answer);
    const double seconds = absl::ToDoubleSeconds(absl::Now() - started_);
    if (status.ok()) {
      around_.log.Debug("call", {{"method", method_}, {"seconds", seconds}});
    } else {
      around_.log.Info("call failed", {{"method", method_},
                                       {"code", static_cast<int>(status.error_code())},
                                       {"error", status.error_message()},
                                       {"seconds", seconds}});
    }
    Finish(status);
  }

  const RpcEnvironment around_;
  const char* const method_;
  grpc::CallbackServerContext* const context_;
  Response* const response_;
  const absl::Time started_ = absl::Now();
  std::atomic<bool> finished_{false};
  std::shared_ptr<UnaryCall> self_;
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_UNARY_CALL_H_
