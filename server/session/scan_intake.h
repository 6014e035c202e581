// How a scan whose data are stored becomes one of the session's: one step of the log.
#ifndef VANTAGE_SERVER_SESSION_SCAN_INTAKE_H_
#define VANTAGE_SERVER_SESSION_SCAN_INTAKE_H_

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/session/session_context.h"
#include "server/session/session_state.h"
#include "server/session/upload.h"

namespace vantage::session {

// The preview that an upload replaces. FAILED_PRECONDITION (SCAN_STATE): that scan is none, or was
// withdrawn. INVALID_ARGUMENT: there is no such scan.
absl::StatusOr<ScanRecord> PreviewOf(const SessionState& state, const v1::Upload& upload);

// Thread safe.
class ScanIntake {
 public:
  explicit ScanIntake(SessionContext& context)
      : context_(context), journal_(context.journal()), dependencies_(context.dependencies()) {}

  struct Arrival {
    v1::Upload upload;  // what is known of the scan
    Upload::Content content;
    storage::v1::LastPieces last_pieces;
    int32_t file_setup = 0;  // of the file that it was read from; 0: it came by itself
  };
  // Logs it, and returns its name; the reconciler has to be told. Its blob has a holder, who is let
  // go where it does not become a scan. `of_file`: the upload of the file that it was read from;
  // such a scan takes the place of the preview that is called as it. RESOURCE_EXHAUSTED
  // (TOO_MANY_PENDING_SCANS; of files TOO_MANY_SCANS); FAILED_PRECONDITION, INVALID_ARGUMENT as of
  // PreviewOf(); ALREADY_EXISTS: that set-up of the file is a scan already.
  absl::StatusOr<std::string> Take(const Arrival& arrival, const std::string& of_file);
  // Whether there is a place for it: RESOURCE_EXHAUSTED as above.
  absl::Status CheckRoom(const SessionState& state, const std::string& of_file) const;

 private:
  // Before the session's first scan, where it says where the model lies (session_origin.h).
  absl::Status PlaceOrigin(const v1::Upload& upload);

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCAN_INTAKE_H_
