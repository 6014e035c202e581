#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::GetScanResponse> GetScan(const session::TenantSessions& sessions,
                                            const v1::GetScanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Scan> scan = (*session)->scans().Get(request.name());
  if (!scan.ok()) return scan.status();
  v1::GetScanResponse response;
  *response.mutable_scan() = *std::move(scan);
  return response;
}

absl::StatusOr<v1::ListScansResponse> ListScans(const session::TenantSessions& sessions,
                                                const v1::ListScansRequest& request) {
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  return ListOfSession<v1::ListScansResponse>(
      sessions, request, "scans", 1000,
      [&](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.scans().List(after, limit, more, request);
      },
      [](v1::ListScansResponse& response) { return response.mutable_scans(); });
}

}  // namespace vantage::rpc::handlers
