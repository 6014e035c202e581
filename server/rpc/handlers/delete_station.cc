// Gives a station up.
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::DeleteStationResponse> DeleteStation(const session::TenantSessions& sessions,
                                                        const v1::DeleteStationRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "stations", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::Status deleted = (*session)->stations().Delete(
      request.name(), session::RequestKey::Of(request.request_id(), "DeleteStation", request));
  if (!deleted.ok()) return deleted;
  return v1::DeleteStationResponse();
}

}  // namespace vantage::rpc::handlers
