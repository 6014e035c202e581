#include <utility>

#include "server/contract/resource_names.h"
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::DeleteSessionResponse> DeleteSession(const session::TenantSessions& sessions,
                                                        const v1::DeleteSessionRequest& request) {
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  const absl::StatusOr<std::string> id = contract::ParseSessionName(request.name(), "name");
  if (!id.ok()) return id.status();
  absl::Status deleted = sessions.Delete(*id, request.request_id());
  if (!deleted.ok()) return deleted;
  return v1::DeleteSessionResponse();
}

}  // namespace vantage::rpc::handlers
