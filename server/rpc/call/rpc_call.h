// One call from its arrival to its end: it is admitted or refused, logged and audited.
#ifndef VANTAGE_SERVER_RPC_CALL_RPC_CALL_H_
#define VANTAGE_SERVER_RPC_CALL_RPC_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "google/protobuf/message.h"
#include "server/rpc/call/authorizer.h"
#include "server/rpc/call/dependencies.h"
#include "server/rpc/call/rules.h"
#include "server/session/tenant_sessions.h"
#include "server/telemetry/log_context.h"
#include "server/telemetry/trace_context.h"

namespace vantage::rpc {

// Thread safe. Lives as long as its reactor.
class RpcCall {
 public:
  // Asks the authorizer. `context` is not kept.
  RpcCall(const RpcDependencies& dependencies, const RpcRule& rule,
          const grpc::ServerContextBase& context);

  ~RpcCall();
  RpcCall(const RpcCall&) = delete;
  RpcCall& operator=(const RpcCall&) = delete;

  // OK, or why the call is refused; then the only answer is this status.
  const absl::Status& admitted() const { return admission_.status; }
  // To be called before each step of a stream.
  absl::Status StillLetIn() const {
    return dependencies_.authorizer.StillLetsIn(rule_, admission_);
  }
  // The sessions that the caller may see.
  const session::TenantSessions& sessions() const { return sessions_; }
  // The call's trace, which the work that it starts takes along.
  const telemetry::LogContext& context() const { return context_; }

  // Notes the resource that the call is about, from its first request.
  void Concerns(const google::protobuf::Message& request);
  // Audits a mutation that was tried, with its outcome; `made` is the response where there is one.
  // To be called also when the client did not wait for it.
  void Audit(const absl::Status& outcome, const google::protobuf::Message* made = nullptr);
  // Ends the call: the client has the status, or is gone. To be called once.
  void End(const grpc::Status& status);

 private:
  Admission Admit(const grpc::ServerContextBase& context);
  void Count(const grpc::Status& status, double seconds) const;

  const RpcDependencies dependencies_;
  const RpcRule& rule_;
  const telemetry::TraceContext trace_;
  const telemetry::LogContext context_;
  bool counted_ = false;  // it has a place among the calls under way
  const Admission admission_;
  const session::TenantSessions sessions_;
  const absl::Time started_ = absl::Now();
  std::mutex mutex_;
  std::string resource_ ABSL_GUARDED_BY(mutex_);
  std::string request_id_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_RPC_CALL_H_
