#include "server/rpc/call/status.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/contract/error.h"
#include "server/contract/whole_characters.h"

namespace vantage::rpc {
namespace {

constexpr absl::Duration kDefaultRetry = absl::Seconds(1);
constexpr size_t kMaxMessage = 1500;  // in the trailer, as it is encoded there
constexpr size_t kMaxDetails = 6144;  // of the trailer's 8 KiB; base64 is not counted by the limit

// The delay of a RetryInfo payload, where there is one.
bool RetryDelay(const absl::Status& status, google::protobuf::Duration& delay) {
  const auto payload = status.GetPayload("type.googleapis.com/google.rpc.RetryInfo");
  google::rpc::RetryInfo info;
  if (!payload.has_value() || !info.ParseFromString(std::string(*payload))) return false;
  delay = info.retry_delay();
  return true;
}

// As much of a message as takes kMaxMessage bytes of the trailer, where every byte but printable
// ASCII is encoded by three.
std::string Sendable(absl::string_view message) {
  size_t bytes = 0;
  for (size_t encoded = 0; bytes < message.size(); ++bytes) {
    const auto byte = static_cast<unsigned char>(message[bytes]);
    encoded += byte < ' ' || byte > '~' || byte == '%' ? 3 : 1;
    if (encoded > kMaxMessage) break;
  }
  return std::string(contract::WholeCharacters(message, bytes));
}

}  // namespace

SentStatus WithDetails(const absl::Status& original) {
  SentStatus sent;
  if (original.ok()) return sent;
  absl::Status status = original;
  if (contract::ReasonOf(status).empty()) {
    absl::Status with_reason = contract::ErrorWithReason(
        status.code(), absl::StatusCodeToString(status.code()), status.message());
    with_reason.ForEachPayload(
        [&](absl::string_view url, const absl::Cord& payload) { status.SetPayload(url, payload); });
  }
  google::protobuf::Duration delay;
  const bool has_delay = RetryDelay(status, delay);
  if (has_delay || absl::IsUnavailable(status)) {
    if (!has_delay) {
      google::rpc::RetryInfo info;
      info.mutable_retry_delay()->set_seconds(absl::ToInt64Seconds(kDefaultRetry));
      contract::AddDetail(status, info);
      delay = info.retry_delay();
    }
    sent.pushback_ms = delay.seconds() * 1000 + delay.nanos() / 1'000'000;
  }
  google::rpc::Status details;
  details.set_code(static_cast<int>(status.code()));
  const std::string message = Sendable(status.message());
  details.set_message(message);
  status.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) {
    if (details.ByteSizeLong() + payload.size() + url.size() > kMaxDetails) return;
    google::protobuf::Any& detail = *details.add_details();
    detail.set_type_url(std::string(url));
    detail.set_value(std::string(payload));
  });
  // The canonical codes of absl and gRPC are the same numbers.
  sent.status = grpc::Status(static_cast<grpc::StatusCode>(status.raw_code()), message,
                             details.SerializeAsString());
  return sent;
}

grpc::Status ToGrpcStatus(const absl::Status& status, grpc::ServerContextBase& context) {
  SentStatus sent = WithDetails(status);
  if (sent.pushback_ms.has_value()) {
    context.AddTrailingMetadata("grpc-retry-pushback-ms", absl::StrCat(*sent.pushback_ms));
  }
  return std::move(sent.status);
}

}  // namespace vantage::rpc
