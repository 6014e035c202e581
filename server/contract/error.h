// Errors as the session raises them: canonical codes that carry machine-readable details (messages
// of google.rpc) as payloads. One place in server/rpc turns them into what gRPC sends.
#ifndef VANTAGE_SERVER_CONTRACT_ERROR_H_
#define VANTAGE_SERVER_CONTRACT_ERROR_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "google/protobuf/message.h"

namespace vantage::contract {

inline constexpr char kErrorDomain[] = "vantage";

// Collects all violations of a request.
class Violations {
 public:
  void Add(absl::string_view field, absl::string_view description);
  void Append(const Violations& others);
  bool empty() const { return violations_.empty(); }
  // OK when there are none; else INVALID_ARGUMENT with a BadRequest that lists them.
  absl::Status ToStatus() const;

 private:
  std::vector<std::pair<std::string, std::string>> violations_;
};

// INVALID_ARGUMENT with one field violation.
absl::Status InvalidField(absl::string_view field, absl::string_view description);

// INVALID_ARGUMENT naming `page_token` (or the field that stands for it): this list did not issue
// the token.
absl::Status UnknownPageToken(absl::string_view field = "page_token");

// A status with an ErrorInfo: `reason` is a stable constant in upper snake case.
absl::Status ErrorWithReason(absl::StatusCode code, absl::string_view reason,
                             absl::string_view message,
                             const std::map<std::string, std::string>& metadata = {});

// NOT_FOUND with ResourceInfo. `type` as the contract names it: 'vantage/Scan'.
absl::Status ResourceNotFound(absl::string_view type, absl::string_view name);

// RESOURCE_EXHAUSTED or UNAVAILABLE with RetryInfo.
absl::Status Retryable(absl::StatusCode code, absl::string_view reason, absl::string_view message,
                       absl::Duration retry_after);

// Attaches a detail, serialised, under its type URL.
void AddDetail(absl::Status& status, const google::protobuf::Message& detail);

// The reason of a status' ErrorInfo; empty where it has none.
std::string ReasonOf(const absl::Status& status);

}  // namespace vantage::contract

#endif  // VANTAGE_SERVER_CONTRACT_ERROR_H_
