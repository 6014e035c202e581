// Errors in words for people: cause and fix, from the error details that the server sends.
#ifndef VANTAGE_CLIENT_LIBRARY_ERROR_H_
#define VANTAGE_CLIENT_LIBRARY_ERROR_H_

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "vantage/v1/error.pb.h"

namespace grpc {
class Status;
}

namespace vantage::client {

// A failed call as a status whose details survive: Explain() reads them. `server` is the address
// that was called.
absl::Status FromRpc(const grpc::Status& status, const std::string& server);

struct Explanation {
  absl::StatusCode code = absl::StatusCode::kUnknown;
  std::string cause;                                // a sentence, without a full stop
  std::vector<std::string> violations;              // 'field: what is wrong with it', all of them
  std::string fix;                                  // what to do about it; may be empty
  std::string reason;                               // the server's stable reason, such as SCAN_LOST
  std::map<std::string, std::string> metadata;      // that belongs to the reason
  std::optional<v1::ClaimConflict> claim_conflict;  // whose place it is, with reason CLAIMED
  std::optional<v1::ExpectedPiece> expected_piece;  // which piece to go on with, with UPLOAD_GAP
  std::optional<double> retry_seconds;              // the server asks to wait this long
};

// Works for any status, of the server or of the client.
Explanation Explain(const absl::Status& status);

// Attaches the fix to an error that the client makes.
absl::Status WithFix(absl::Status status, const std::string& fix);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_ERROR_H_
