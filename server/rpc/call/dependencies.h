// The objects that RPCs use.
#ifndef VANTAGE_SERVER_RPC_CALL_DEPENDENCIES_H_
#define VANTAGE_SERVER_RPC_CALL_DEPENDENCIES_H_

#include <chrono>

#include "server/execution/task_pool.h"
#include "server/execution/timer.h"
#include "server/rpc/call/authorizer.h"
#include "server/rpc/call/call_counts.h"
#include "server/session/session_registry.h"
#include "server/telemetry/log.h"
#include "server/telemetry/metrics.h"

namespace vantage::rpc {

// All of these outlive the gRPC server.
struct RpcDependencies {
  session::SessionRegistry& sessions;
  execution::TaskPool& tasks;
  execution::Timer& timer;
  telemetry::Log& log;
  Authorizer& authorizer;
  telemetry::Metrics& metrics;
  CallCounts& calls;
  // The longest silence of a stream; the contract promises 15 s at most.
  std::chrono::milliseconds heartbeat;
};

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_DEPENDENCIES_H_
