#include "server/web/connect/call_request.h"

#include <memory>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "server/web/connect/envelope.h"
#include "server/web/connect/error.h"
#include "server/web/connect/transcoding.h"

namespace vantage::web {
namespace {

constexpr absl::string_view kStreamType = "application/connect+";
constexpr absl::string_view kUnaryType = "application/";
// Of connect-timeout-ms: more than three months.
constexpr size_t kMaxTimeoutDigits = 10;

// 'application/json' of 'application/json; charset=utf-8'.
std::string MediaType(const std::string& content_type) {
  const absl::string_view whole = content_type;
  return absl::AsciiStrToLower(absl::StripAsciiWhitespace(whole.substr(0, whole.find(';'))));
}

std::string TypeOf(bool stream, bool json) {
  return absl::StrCat(stream ? kStreamType : kUnaryType, json ? "json" : "proto");
}

grpc::Status Wrong(absl::string_view what) { return OwnError(absl::InvalidArgumentError(what)); }

// OK, or what the protocol's own headers ask for that there is not.
grpc::Status ReadProtocol(const Request& head, CallRequest& call) {
  const std::string* version = head.Find("connect-protocol-version");
  if (version != nullptr && *version != "1") {
    return Wrong("connect-protocol-version must be 1");
  }
  const std::string* timeout = head.Find("connect-timeout-ms");
  if (timeout != nullptr) {
    int64_t milliseconds = 0;
    if (timeout->empty() || timeout->size() > kMaxTimeoutDigits ||
        timeout->find_first_not_of("0123456789") != std::string::npos ||
        !absl::SimpleAtoi(*timeout, &milliseconds)) {
      return Wrong("connect-timeout-ms must be a number of at most 10 digits");
    }
    call.timeout = std::chrono::milliseconds(milliseconds);
  }
  const std::string* coding =
      head.Find(call.stream ? "connect-content-encoding" : "content-encoding");
  if (coding != nullptr && !absl::EqualsIgnoreCase(*coding, "identity")) {
    return OwnError(absl::UnimplementedError(
        "this server takes no compressed messages; supported encodings: identity"));
  }
  return grpc::Status::OK;
}

Response WithBody(int status, std::string type, std::string body) {
  return {status,
          {{"content-type", std::move(type)},
           {"cache-control", "no-store"},
           {"x-content-type-options", "nosniff"}},
          std::make_shared<const std::string>(std::move(body))};
}

}  // namespace

std::string CallRequest::path() const {
  return absl::StrCat("/", method->service()->full_name(), "/", method->name());
}

RpcDirectory::RpcDirectory(const std::vector<std::string>& services) {
  for (const std::string& name : services) {
    const auto* service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; service != nullptr && i < service->method_count(); ++i) {
      methods_[absl::StrCat("/", name, "/", service->method(i)->name())] = service->method(i);
    }
  }
}

const google::protobuf::MethodDescriptor* RpcDirectory::Find(absl::string_view path) const {
  const auto found = methods_.find(path);
  return found == methods_.end() ? nullptr : found->second;
}

std::variant<CallRequest, Response> ReadCall(const google::protobuf::MethodDescriptor& method,
                                             const Request& head) {
  if (head.method != "POST") {
    Response refused = TextResponse(405, "RPCs are called by POST");
    refused.fields.push_back({"allow", "POST"});
    return refused;
  }
  CallRequest call;
  call.method = &method;
  call.stream = method.server_streaming() || method.client_streaming();
  const std::string* given = head.Find("content-type");
  const std::string type = given == nullptr ? "" : MediaType(*given);
  call.json = type == TypeOf(call.stream, true);
  if (!call.json && type != TypeOf(call.stream, false)) {
    const std::string takes =
        absl::StrCat(TypeOf(call.stream, false), ", ", TypeOf(call.stream, true));
    Response refused = TextResponse(415, absl::StrCat("this RPC takes ", takes));
    refused.fields.push_back({"accept-post", takes});
    return refused;
  }
  if (method.client_streaming()) {
    return ErrorAnswer(call, OwnError(absl::UnimplementedError(
                                 absl::StrCat(method.name(),
                                              " streams both ways, which HTTP/1.1 cannot: call "
                                              "it over gRPC, or use its unary twin"))));
  }
  if (call.stream && head.http_1_0) return TextResponse(505, "streams need HTTP/1.1");
  if (const grpc::Status read = ReadProtocol(head, call); !read.ok()) {
    return ErrorAnswer(call, read);
  }
  return call;
}

absl::StatusOr<std::string> ReadMessage(const CallRequest& call, std::string body) {
  if (call.stream) {
    absl::StatusOr<absl::string_view> only = OnlyMessage(body);
    if (!only.ok()) return only.status();
    body.erase(0, body.size() - only->size());
  }
  if (!call.json) return body;
  return BinaryOf(*call.method->input_type(), body);
}

absl::StatusOr<Response> UnaryAnswer(const CallRequest& call, std::string message) {
  if (call.json) {
    absl::StatusOr<std::string> json = JsonOf(*call.method->output_type(), message);
    if (!json.ok()) return json.status();
    message = *std::move(json);
  }
  return WithBody(200, TypeOf(false, call.json), std::move(message));
}

Response ErrorAnswer(const CallRequest& call, const grpc::Status& status) {
  if (call.stream) return WithBody(200, TypeOf(true, call.json), StreamEnd(status));
  return WithBody(HttpStatusOf(status.error_code()), "application/json", ErrorJson(status));
}

Response StreamBeginning(const CallRequest& call) {
  Response beginning = WithBody(200, TypeOf(true, call.json), "");
  beginning.body = nullptr;
  // Proxies that would collect an answer before they pass it on leave this one alone.
  beginning.fields.push_back({"x-accel-buffering", "no"});
  return beginning;
}

absl::StatusOr<std::string> StreamMessage(const CallRequest& call, const std::string& message) {
  if (!call.json) return Enveloped(0, message);
  const absl::StatusOr<std::string> json = JsonOf(*call.method->output_type(), message);
  if (!json.ok()) return json.status();
  return Enveloped(0, *json);
}

std::string StreamEnd(const grpc::Status& status) {
  return Enveloped(kEndOfStreamFlag, EndOfStreamJson(status));
}

}  // namespace vantage::web
