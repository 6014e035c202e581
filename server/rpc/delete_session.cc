#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::DeleteSessionResponse> DeleteSession(const TenantSessions& sessions,
                                                        const v1::DeleteSessionRequest& request) {
  absl::Status deleted = sessions.Delete(request);
  if (!deleted.ok()) return deleted;
  return v1::DeleteSessionResponse();
}

}  // namespace vantage::handlers
