// A unary RPC whose handler runs on our own threads.
#ifndef VANTAGE_SERVER_RPC_CALL_UNARY_CALL_H_
#define VANTAGE_SERVER_RPC_CALL_UNARY_CALL_H_

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <memory>
#include <new>
#include <stop_token>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "server/contract/error.h"
#include "server/contract/out_of_memory.h"
#include "server/rpc/call/dependencies.h"
#include "server/rpc/call/rpc_call.h"
#include "server/rpc/call/status.h"

namespace vantage::rpc {

// Keeps itself alive until gRPC is done with it and no handler refers to it. The handler works on a
// copy of the request, and its answer is used only if the call has not finished yet; so a call that
// is cancelled meanwhile finishes at once and is not touched again.
template <typename Request, typename Response>
class UnaryCall final : public grpc::ServerUnaryReactor,
                        public std::enable_shared_from_this<UnaryCall<Request, Response>> {
 public:
  using Answer = absl::StatusOr<Response>;
  using Done = std::function<void(Answer)>;
  using AsyncHandler = std::function<void(const session::TenantSessions&, const Request&, Done)>;
  // One whose work ends soon when the caller has gone: it gave up, or its deadline has passed.
  using StoppableHandler = void (*)(const session::TenantSessions&, const Request&,
                                    const std::stop_token& gone, Done);
  using Handler = Answer (*)(const session::TenantSessions&, const Request&);

  // `handler` calls its last argument exactly once, on any thread.
  static grpc::ServerUnaryReactor* Start(const RpcDependencies& dependencies, const RpcRule& rule,
                                         grpc::CallbackServerContext* context,
                                         const Request* request, Response* response,
                                         AsyncHandler handler) {
    return Begin(
        dependencies, rule, context, request, response,
        [handler = std::move(handler)](const session::TenantSessions& sessions,
                                       const Request& asked, const std::stop_token&,
                                       Done done) { handler(sessions, asked, std::move(done)); });
  }

  static grpc::ServerUnaryReactor* Start(const RpcDependencies& dependencies, const RpcRule& rule,
                                         grpc::CallbackServerContext* context,
                                         const Request* request, Response* response,
                                         StoppableHandler handler) {
    return Begin(dependencies, rule, context, request, response, handler);
  }

  static grpc::ServerUnaryReactor* Start(const RpcDependencies& dependencies, const RpcRule& rule,
                                         grpc::CallbackServerContext* context,
                                         const Request* request, Response* response,
                                         Handler handler) {
    return Begin(
        dependencies, rule, context, request, response,
        [handler](const session::TenantSessions& sessions, const Request& asked,
                  const std::stop_token&, const Done& done) { done(handler(sessions, asked)); });
  }

  void OnCancel() override {
    gone_.request_stop();
    if (finished_.exchange(true)) return;
    call_.End(grpc::Status::CANCELLED);
    Finish(grpc::Status::CANCELLED);
  }
  void OnDone() override { self_.reset(); }

 private:
  template <typename Handle>
  static grpc::ServerUnaryReactor* Begin(const RpcDependencies& dependencies, const RpcRule& rule,
                                         grpc::CallbackServerContext* context,
                                         const Request* request, Response* response,
                                         Handle handle) {
    std::shared_ptr<UnaryCall> call(new UnaryCall(dependencies, rule, context, response));
    call->self_ = call;
    call->call_.Concerns(*request);
    if (!call->call_.admitted().ok()) {
      call->Complete(call->call_.admitted());
      return call.get();
    }
    const telemetry::ScopedLogContext scope(call->call_.context());
    const bool posted =
        dependencies.tasks.TryPost([call, copy = *request, handle = std::move(handle)] {
          if (call->finished_) return;  // cancelled while it waited
          try {
            handle(call->call_.sessions(), copy, call->gone_.get_token(),
                   [call](Answer answer) { call->Complete(std::move(answer)); });
          } catch (const std::bad_alloc&) {
            call->Complete(contract::OutOfMemory());
          }
        });
    if (!posted) {
      call->Complete(contract::Retryable(absl::StatusCode::kResourceExhausted, "SERVER_BUSY",
                                         "too many requests wait; try again",
                                         absl::Milliseconds(500)));
    }
    return call.get();
  }

  UnaryCall(const RpcDependencies& dependencies, const RpcRule& rule,
            grpc::CallbackServerContext* context, Response* response)
      : call_(dependencies, rule, *context), context_(context), response_(response) {}

  void Complete(Answer answer) {
    // What was thrown while it was being answered changes nothing.
    if (answered_.exchange(true)) return;
    // The mutation was made, whether or not the client still waits for the answer.
    bool said = WithMemory([&] { call_.Audit(answer.status(), answer.ok() ? &*answer : nullptr); });
    if (finished_.exchange(true)) return;
    grpc::Status status;
    said = WithMemory([&] {
             status = ToGrpcStatus(answer.status(), *context_);
             if (answer.ok()) *response_ = *std::move(answer);
           }) &&
           said;
    // Who waits is told, even where there is no memory for words.
    if (!said) status = grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "");
    WithMemory([&] { call_.End(status); });
    Finish(status);
  }

  // False where there was not enough for `step`.
  template <typename Step>
  static bool WithMemory(Step&& step) {
    try {
      step();
      return true;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }

  RpcCall call_;
  grpc::CallbackServerContext* const context_;
  Response* const response_;
  std::atomic<bool> answered_{false};
  std::atomic<bool> finished_{false};
  std::stop_source gone_;
  std::shared_ptr<UnaryCall> self_;
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_UNARY_CALL_H_
