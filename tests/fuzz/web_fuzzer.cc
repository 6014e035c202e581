#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "google/protobuf/message.h"
#include "google/rpc/status.pb.h"
#include "server/rpc/services.h"
#include "server/web/connect/call_request.h"
#include "server/web/connect/envelope.h"
#include "server/web/connect/error.h"
#include "server/web/connect/transcoding.h"
#include "server/web/http/request_reader.h"
#include "server/web/router.h"

namespace vantage::fuzz {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::Message;

void Require(bool holds) {
  if (!holds) std::abort();
}

struct ReadResult {
  std::optional<web::Request> request;  // where it is whole, and not refused
  std::string rest;
};

// The first request of `bytes`, of which at most `step` more are shown at a time.
ReadResult ReadFirst(absl::string_view bytes, size_t step) {
  web::RequestReader reader;
  std::string shown;
  size_t next = 0;
  while (true) {
    const absl::StatusOr<size_t> used = reader.Take(shown);
    if (!used.ok()) return {};
    Require(*used <= shown.size());
    shown.erase(0, *used);
    // As a connection does it: beyond this the head is refused.
    Require(reader.has_head() || shown.size() <= web::kMaxHeadBytes + step);
    if (reader.done()) break;
    if (*used > 0 && !shown.empty()) continue;
    if (next == bytes.size()) return {};
    const size_t more = std::min(step, bytes.size() - next);
    shown.append(bytes.data() + next, more);
    next += more;
  }
  return {reader.Finish(), shown + std::string(bytes.substr(next))};
}

const web::Router& TheRouter(bool identified) {
  const auto make = [](bool callers) {
    return new web::Router(
        {rpc::Services::Names(), {"https://crew.example", "http://scan.local:7466"}, callers},
        web::PageFiles());
  };
  static const web::Router& open = *make(false);
  static const web::Router& told_apart = *make(true);
  return identified ? told_apart : open;
}

std::unique_ptr<Message> NewMessage(const Descriptor& type) {
  return std::unique_ptr<Message>(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
}

// What is a message is the same one after it was told in JSON.
void CheckWords(const Descriptor& type, const std::string& binary) {
  const auto message = NewMessage(type);
  if (!message->ParseFromString(binary)) return;
  const absl::StatusOr<std::string> json = web::JsonOf(type, message->SerializeAsString());
  if (!json.ok()) return;  // a time beyond the year 9999, say
  const absl::StatusOr<std::string> back = web::BinaryOf(type, *json);
  Require(back.ok());
  const auto again = NewMessage(type);
  Require(again->ParseFromString(*back));
}

void CheckCall(const web::CallRequest& call, const std::string& body) {
  const absl::StatusOr<std::string> message = web::ReadMessage(call, body);
  if (!message.ok()) {
    Require(absl::IsInvalidArgument(message.status()) || absl::IsUnimplemented(message.status()));
    return;
  }
  if (!call.json) return;
  // What was read of JSON is a message, and no larger than the bounds of bodies foresee.
  Require(NewMessage(*call.method->input_type())->ParseFromString(*message));
  CheckWords(*call.method->input_type(), *message);
}

// A request as it comes: read in pieces or at once it is the same one, and it is answered, or is a
// call of an RPC that there is.
void CheckHttp(absl::string_view bytes, size_t step) {
  ReadResult whole = ReadFirst(bytes, bytes.size() + 1);
  const ReadResult pieces = ReadFirst(bytes, step);
  // What is wrong may be seen sooner or later, but never by one of the two alone once all is there.
  Require(whole.request.has_value() == pieces.request.has_value());
  if (!whole.request.has_value()) return;
  Require(whole.request->body == pieces.request->body && whole.rest == pieces.rest);
  Require(whole.request->target == pieces.request->target);
  Require(whole.request->fields.size() == pieces.request->fields.size());
  for (const bool identified : {false, true}) {
    const auto leads_to = TheRouter(identified).Route(*whole.request);
    if (const auto* call = std::get_if<web::CallRequest>(&leads_to); call != nullptr) {
      Require(whole.request->method == "POST" && call->path() == whole.request->path());
      CheckCall(*call, whole.request->body);
      continue;
    }
    const auto& answer = std::get<web::Response>(leads_to);
    // Nothing that was asked for becomes a line of the head.
    for (const web::Field& field : answer.fields) {
      Require(field.value.find_first_of("\r\n") == std::string::npos);
    }
    const std::string head = web::HeadOf(answer, whole.request->keep_alive);
    Require(head.find("\r\n\r\n") == head.size() - 4);
  }
}

// A body for one RPC or another, in one form or another.
void CheckBody(uint8_t which, absl::string_view bytes) {
  static const auto& methods = *[] {
    auto* all = new std::vector<const google::protobuf::MethodDescriptor*>;
    for (const std::string& name : rpc::Services::Names()) {
      const auto* service =
          google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
      for (int i = 0; i < service->method_count(); ++i) all->push_back(service->method(i));
    }
    return all;
  }();
  web::CallRequest call;
  call.method = methods[which % methods.size()];
  const std::string body(bytes);
  for (const bool json : {true, false}) {
    for (const bool stream : {true, false}) {
      call.json = json;
      call.stream = stream;
      CheckCall(call, body);
    }
  }
  CheckWords(*call.method->output_type(), body);
  CheckWords(*call.method->input_type(), body);
  const std::string enveloped = web::Enveloped(0, body);
  Require(*web::OnlyMessage(enveloped) == bytes);
}

// An error of any words and details is JSON.
void CheckError(uint8_t code, absl::string_view bytes) {
  google::rpc::Status details;
  const size_t half = bytes.size() / 2;
  details.add_details()->set_type_url("type.googleapis.com/google.rpc.BadRequest");
  details.mutable_details(0)->set_value(std::string(bytes.substr(half)));
  details.add_details()->set_type_url(std::string(bytes.substr(0, half)));
  for (const std::string& sent : {details.SerializeAsString(), std::string(bytes)}) {
    const grpc::Status status(static_cast<grpc::StatusCode>(code % 17), std::string(bytes), sent);
    Require(!nlohmann::json::parse(web::ErrorJson(status), nullptr, false).is_discarded());
    Require(!nlohmann::json::parse(web::EndOfStreamJson(status), nullptr, false).is_discarded());
  }
  web::AcceptsGzip(bytes);
}

}  // namespace
}  // namespace vantage::fuzz

// A byte for what the rest is: a request of HTTP/1.1, the body of a call, or an error; and one for
// how.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace vantage;  // NOLINT: the entry point's name is not ours
  if (size < 2) return 0;
  const absl::string_view rest(reinterpret_cast<const char*>(data) + 2, size - 2);  // NOLINT: bytes
  switch (data[0] % 4) {
    case 0:
    case 1:
      fuzz::CheckHttp(rest, size_t{1} + data[1]);
      break;
    case 2:
      fuzz::CheckBody(data[1], rest);
      break;
    default:
      fuzz::CheckError(data[1], rest);
  }
  return 0;
}
