// What a request of the Connect protocol (https://connectrpc.com/docs/protocol) asks for.
#ifndef VANTAGE_SERVER_WEB_CONNECT_CALL_REQUEST_H_
#define VANTAGE_SERVER_WEB_CONNECT_CALL_REQUEST_H_

#include <grpcpp/support/status.h>

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "google/protobuf/descriptor.h"
#include "server/web/http/message.h"

namespace vantage::web {

// A call, by the head of its request.
struct CallRequest {
  const google::protobuf::MethodDescriptor* method = nullptr;
  bool stream = false;  // the answer is a stream, in envelopes; else one message
  bool json = false;
  std::optional<std::chrono::milliseconds> timeout;

  // '/vantage.v1.PlanService/CreatePlan', as it is for gRPC.
  std::string path() const;
};

// The RPCs of some services, from their descriptors.
class RpcDirectory {
 public:
  // `services`: full names, which are compiled in.
  explicit RpcDirectory(const std::vector<std::string>& services);

  // Null: there is no such RPC. `path` as in CallRequest.
  const google::protobuf::MethodDescriptor* Find(absl::string_view path) const;

 private:
  std::map<std::string, const google::protobuf::MethodDescriptor*, std::less<>> methods_;
};

// What a request for `method` wants; or the answer that says why there can be none.
std::variant<CallRequest, Response> ReadCall(const google::protobuf::MethodDescriptor& method,
                                             const Request& head);

// The message that the body holds, serialized. INVALID_ARGUMENT, UNIMPLEMENTED: as OnlyMessage()
// and BinaryOf().
absl::StatusOr<std::string> ReadMessage(const CallRequest& call, std::string body);

// The answer to a unary call that succeeded. INTERNAL: as JsonOf().
absl::StatusOr<Response> UnaryAnswer(const CallRequest& call, std::string message);
// The answer to a call that failed before anything of an answer was sent.
Response ErrorAnswer(const CallRequest& call, const grpc::Status& status);
// How the answer to a stream begins; its messages follow, in envelopes.
Response StreamBeginning(const CallRequest& call);
// A message of a stream in its envelope. INTERNAL: as JsonOf().
absl::StatusOr<std::string> StreamMessage(const CallRequest& call, const std::string& message);
// What ends a stream.
std::string StreamEnd(const grpc::Status& status);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_CONNECT_CALL_REQUEST_H_
