#include "server/contract/error.h"

#include <algorithm>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "google/rpc/error_details.pb.h"
#include "server/contract/whole_characters.h"

namespace vantage::contract {
namespace {

constexpr char kTypePrefix[] = "type.googleapis.com/";
// Details travel in a trailer of at most 8 KiB.
constexpr size_t kMaxViolations = 64;
constexpr size_t kMaxViolationBytes = 4500;
constexpr size_t kMaxText = 160;

std::string Shortened(absl::string_view text) {
  return text.size() <= kMaxText ? std::string(text)
                                 : absl::StrCat(WholeCharacters(text, kMaxText - 3), "...");
}

}  // namespace

void AddDetail(absl::Status& status, const google::protobuf::Message& detail) {
  status.SetPayload(absl::StrCat(kTypePrefix, detail.GetDescriptor()->full_name()),
                    absl::Cord(detail.SerializeAsString()));
}

absl::Status ErrorWithReason(absl::StatusCode code, absl::string_view reason,
                             absl::string_view message,
                             const std::map<std::string, std::string>& metadata) {
  absl::Status status(code, message);
  google::rpc::ErrorInfo info;
  info.set_reason(std::string(reason));
  info.set_domain(kErrorDomain);
  for (const auto& [key, value] : metadata) (*info.mutable_metadata())[key] = Shortened(value);
  AddDetail(status, info);
  return status;
}

void Violations::Add(absl::string_view field, absl::string_view description) {
  violations_.emplace_back(field, description);
}

void Violations::Append(const Violations& others) {
  violations_.insert(violations_.end(), others.violations_.begin(), others.violations_.end());
}

absl::Status Violations::ToStatus() const {
  if (violations_.empty()) return absl::OkStatus();
  google::rpc::BadRequest request;
  std::vector<std::string> words;
  size_t listed = 0;
  for (const auto& [field, description] : violations_) {
    if (listed == kMaxViolations || request.ByteSizeLong() > kMaxViolationBytes) break;
    ++listed;
    auto* violation = request.add_field_violations();
    violation->set_field(Shortened(field));
    violation->set_description(Shortened(description));
    words.push_back(absl::StrCat(Shortened(field), ": ", Shortened(description)));
  }
  if (listed < violations_.size()) {
    words.push_back(absl::StrCat(violations_.size() - listed, " more"));
  }
  std::string message = absl::StrJoin(words, "; ");
  if (message.size() > 1000) message = absl::StrCat(WholeCharacters(message, 997), "...");
  absl::Status status =
      ErrorWithReason(absl::StatusCode::kInvalidArgument, "INVALID_FIELDS", message);
  AddDetail(status, request);
  return status;
}

absl::Status InvalidField(absl::string_view field, absl::string_view description) {
  Violations violations;
  violations.Add(field, description);
  return violations.ToStatus();
}

absl::Status UnknownPageToken(absl::string_view field) {
  return InvalidField(field, "is none that this list gave; begin without one");
}

absl::Status ResourceNotFound(absl::string_view type, absl::string_view name) {
  absl::Status status = ErrorWithReason(absl::StatusCode::kNotFound, "NOT_FOUND",
                                        absl::StrCat(Shortened(name), " does not exist"));
  google::rpc::ResourceInfo info;
  info.set_resource_type(std::string(type));
  info.set_resource_name(Shortened(name));
  info.set_description("does not exist, or no longer");
  AddDetail(status, info);
  return status;
}

absl::Status Retryable(absl::StatusCode code, absl::string_view reason, absl::string_view message,
                       absl::Duration retry_after) {
  absl::Status status = ErrorWithReason(code, reason, message);
  google::rpc::RetryInfo info;
  const int64_t nanos = absl::ToInt64Nanoseconds(retry_after);
  info.mutable_retry_delay()->set_seconds(nanos / 1'000'000'000);
  info.mutable_retry_delay()->set_nanos(static_cast<int32_t>(nanos % 1'000'000'000));
  AddDetail(status, info);
  return status;
}

std::string ReasonOf(const absl::Status& status) {
  const auto payload = status.GetPayload(absl::StrCat(kTypePrefix, "google.rpc.ErrorInfo"));
  google::rpc::ErrorInfo info;
  if (!payload.has_value() || !info.ParseFromString(std::string(*payload))) return "";
  return info.reason();
}

}  // namespace vantage::contract
