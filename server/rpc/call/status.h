// The one place that turns an absl::Status into a gRPC status with details.
#ifndef VANTAGE_SERVER_RPC_CALL_STATUS_H_
#define VANTAGE_SERVER_RPC_CALL_STATUS_H_

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <optional>

#include "absl/status/status.h"

namespace vantage::rpc {

struct SentStatus {
  grpc::Status status;
  // When the same call may succeed, ms from now; nullopt: that is not known.
  std::optional<int64_t> pushback_ms;
};

// Every error gets an ErrorInfo of domain 'vantage' (one with the code's name as reason where it
// has none), and its payloads as a google.rpc.Status in grpc-status-details-bin. UNAVAILABLE gets a
// RetryInfo (one second) where it has none; what has one gets the trailer grpc-retry-pushback-ms,
// too, since gRPC's own retry heeds only that. RESOURCE_EXHAUSTED without one lasts until somebody
// makes room, so it gets none. INTERNAL and UNKNOWN say nothing of the server's inside beyond their
// message.
SentStatus WithDetails(const absl::Status& status);
// The same, with the trailer set.
grpc::Status ToGrpcStatus(const absl::Status& status, grpc::ServerContextBase& context);

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_CALL_STATUS_H_
