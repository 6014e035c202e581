#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::ImportSessionResponse> ImportSession(const session::TenantSessions& sessions,
                                                        const v1::ImportSessionRequest& request) {
  if (absl::Status open = sessions.CheckTakesWork(); !open.ok()) return open;
  absl::Status valid = conversion::CheckRequest(request, sessions.limits());
  if (!valid.ok()) return valid;
  return sessions.Import(request);
}

}  // namespace vantage::rpc::handlers
