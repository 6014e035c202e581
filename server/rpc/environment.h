// What RPCs run on.
#ifndef VANTAGE_SERVER_RPC_ENVIRONMENT_H_
#define VANTAGE_SERVER_RPC_ENVIRONMENT_H_

#include <atomic>

#include "server/execution/task_pool.h"
#include "server/execution/timer.h"
#include "server/observe/log.h"
#include "server/observe/metrics.h"
#include "server/rpc/gate.h"
#include "server/session/session_registry.h"

namespace vantage {

// All of it outlives the gRPC server.
struct RpcEnvironment {
  SessionRegistry& sessions;
  TaskPool& tasks;
  Timer& timer;
  Log& log;
  Gate& gate;
  Metrics& metrics;
  std::atomic<int>& calls_under_way;
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_ENVIRONMENT_H_
