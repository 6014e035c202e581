// One call from its arrival to its end: let in or refused, logged, audited.
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

  // OK, or why it is refused: nothing but that may be answered then.
  const absl::Status& admitted() const { return admission_.status; }
  // Of a stream, before each of its steps.
  absl::Status StillLetIn() const {
    return dependencies_.authorizer.StillLetsIn(rule_, admission_);
  }
  // Those that the caller may see.
  const session::TenantSessions& sessions() const { return sessions_; }
  // Of its trace: work that it sets off takes it along.
  const telemetry::LogContext& context() const { return context_; }

  // What it is about, as its first request says.
  void Concerns(const google::protobuf::Message& request);
  // A mutation was tried with this outcome; `made` is the response where there is one. Also when
  // the client did not wait for it.
  void Audit(const absl::Status& outcome, const google::protobuf::Message* made = nullptr);
  // The client has the status, or is gone. Once.
  void End(const grpc::Status& status);

 private:
  Admission Admit(const grpc::ServerContextBase& context) const;
  void Count(const grpc::Status& status, double seconds) const;

  const RpcDependencies dependencies_;
  const RpcRule& rule_;
  const std::string peer_;
  const telemetry::TraceContext trace_;
  const telemetry::LogContext context_;
  const Admission admission_;
  const session::TenantSessions sessions_;
  const absl::Time started_ = absl::Now();
  std::mutex mutex_;
  std::string resource_ ABSL_GUARDED_BY(mutex_);
  std::string request_id_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_RPC_CALL_H_
