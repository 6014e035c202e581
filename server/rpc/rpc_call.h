// One call from its arrival to its end: let in or refused, logged, audited.
#ifndef VANTAGE_SERVER_RPC_RPC_CALL_H_
#define VANTAGE_SERVER_RPC_RPC_CALL_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <mutex>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "google/protobuf/message.h"
#include "server/observe/log_context.h"
#include "server/observe/trace_context.h"
#include "server/rpc/environment.h"
#include "server/rpc/gate.h"
#include "server/rpc/rules.h"
#include "server/session/tenant_sessions.h"

namespace vantage {

// Thread safe. Lives as long as its reactor.
class RpcCall {
 public:
  // Asks the gate. `context` is not kept.
  RpcCall(const RpcEnvironment& around, const RpcRule& rule,
          const grpc::ServerContextBase& context);

  ~RpcCall();
  RpcCall(const RpcCall&) = delete;
  RpcCall& operator=(const RpcCall&) = delete;

  // OK, or why it is refused: nothing but that may be answered then.
  const absl::Status& admitted() const { return admission_.status; }
  // Of a stream, before each of its steps.
  absl::Status StillLetIn() const { return around_.gate.StillLetsIn(rule_, admission_); }
  // Those that the caller may see.
  const TenantSessions& sessions() const { return sessions_; }
  // Of its trace: work that it sets off takes it along.
  const LogContext& context() const { return context_; }

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

  const RpcEnvironment around_;
  const RpcRule& rule_;
  const std::string peer_;
  const TraceContext trace_;
  const LogContext context_;
  const Admission admission_;
  const TenantSessions sessions_;
  const absl::Time started_ = absl::Now();
  std::mutex mutex_;
  std::string resource_ ABSL_GUARDED_BY(mutex_);
  std::string request_id_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_RPC_CALL_H_
