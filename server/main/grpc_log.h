// What gRPC has to say, in the server's own log.
#ifndef VANTAGE_SERVER_MAIN_GRPC_LOG_H_
#define VANTAGE_SERVER_MAIN_GRPC_LOG_H_

#include "server/telemetry/log.h"

namespace vantage::server {

// While this object lives, gRPC writes to `log` what it would write to standard error, where a
// reader that stalls would hold gRPC's threads. One at a time: gRPC has one place to write to in a
// process, and gives it no context.
class GrpcLog {
 public:
  explicit GrpcLog(telemetry::Log& log);
  ~GrpcLog();
  GrpcLog(const GrpcLog&) = delete;
  GrpcLog& operator=(const GrpcLog&) = delete;
};

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_GRPC_LOG_H_
