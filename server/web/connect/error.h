// Errors as the Connect protocol has them.
#ifndef VANTAGE_SERVER_WEB_CONNECT_ERROR_H_
#define VANTAGE_SERVER_WEB_CONNECT_ERROR_H_

#include <grpcpp/support/status.h>

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace vantage::web {

// 'not_found'; 'unknown' for what is no error's code.
absl::string_view CodeName(grpc::StatusCode code);
// The status of a unary call's answer.
int HttpStatusOf(grpc::StatusCode code);

// Code, message and details, each of these also in words where its type is known. JSON; what is no
// UTF-8 in a message is replaced.
std::string ErrorJson(const grpc::Status& status);
// The last message of a stream, in JSON whatever the messages before it were in.
std::string EndOfStreamJson(const grpc::Status& status);

// An error that the gateway itself found, as the server would have sent it: with its reason.
grpc::Status OwnError(const absl::Status& status);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_CONNECT_ERROR_H_
