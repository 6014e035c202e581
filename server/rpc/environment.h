// What RPCs run on.
#ifndef VANTAGE_SERVER_RPC_ENVIRONMENT_H_
#define VANTAGE_SERVER_RPC_ENVIRONMENT_H_

#include "server/execution/task_pool.h"
#include "server/execution/timer.h"
#include "server/observe/log.h"
#include "server/session/session_registry.h"

namespace vantage {

// All of it outlives the gRPC server.
struct RpcEnvironment {
  SessionRegistry& sessions;
  TaskPool& tasks;
  Timer& timer;
  Log& log;
};

}  // namespace vantage

#endif  // VANTAGE_SERVER_RPC_ENVIRONMENT_H_
