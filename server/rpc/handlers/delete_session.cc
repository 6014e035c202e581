#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::DeleteSessionResponse> DeleteSession(const session::TenantSessions& sessions,
                                                        const v1::DeleteSessionRequest& request) {
  absl::Status deleted = sessions.Delete(request);
  if (!deleted.ok()) return deleted;
  return v1::DeleteSessionResponse();
}

}  // namespace vantage::rpc::handlers
