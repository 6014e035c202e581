// What went wrong, in words for people: cause and fix, from the error details that the server
// sends.
#ifndef VANTAGE_CLIENT_LIBRARY_ERROR_H_
#define VANTAGE_CLIENT_LIBRARY_ERROR_H_

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace grpc {
class Status;
}

namespace vantage {

// A failed call as a status whose details survive: Explain() reads them. `server` is the address
// that was called.
absl::Status FromRpc(const grpc::Status& status, const std::string& server);

struct Explanation {
  absl::StatusCode code = absl::StatusCode::kUnknown;
  std::string cause;                    // a sentence, without a full stop
  std::vector<std::string> violations;  // 'field: what is wrong with it', all of them
  std::string fix;                      // what to do about it; may be empty
  std::string reason;                   // the server's stable reason, such as SCAN_NOT_FOUND
  std::map<std::string, std::string> metadata;  // that comes with the reason
  std::optional<double> retry_seconds;          // the server asks to wait this long
};

// Works for any status, of the server or of our own making.
Explanation Explain(const absl::Status& status);

// Attaches what to do about an error of our own making.
absl::Status WithFix(absl::Status status, const std::string& fix);

}  // namespace vantage

#endif  // VANTAGE_CLIENT_LIBRARY_ERROR_H_
