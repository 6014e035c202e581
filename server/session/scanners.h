// A session's fleet: the scanners that were added to it. Their whole state is in the log.
#ifndef VANTAGE_SERVER_SESSION_SCANNERS_H_
#define VANTAGE_SERVER_SESSION_SCANNERS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/session/session_context.h"
#include "vantage/v1/fleet_service.pb.h"

namespace vantage::session {

// Thread safe: the log's locks are all that it needs.
class Scanners {
 public:
  explicit Scanners(SessionContext& context) : context_(context) {}

  // Takes the request as it came: its scanner's message is what the log stores, and its id is
  // chosen here where it has none.
  absl::StatusOr<v1::Scanner> Create(const v1::CreateScannerRequest& request);
  // Takes the request as it came: its mask names fields of the message that the log stores.
  absl::StatusOr<v1::Scanner> Update(const v1::UpdateScannerRequest& request);
  // FAILED_PRECONDITION (SCANNER_IN_USE): a claim, a station or an upload is its own.
  absl::Status Delete(const std::string& name, const RequestKey& key);
  // NOT_FOUND.
  absl::StatusOr<v1::Scanner> Get(const std::string& name) const;
  // In pages, as in Scans::List().
  absl::StatusOr<std::vector<v1::Scanner>> List(absl::string_view after, size_t limit,
                                                bool& more) const;

 private:
  SessionContext& context_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCANNERS_H_
