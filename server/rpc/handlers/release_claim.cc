// Ends a claim.
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::ReleaseClaimResponse> ReleaseClaim(const session::TenantSessions& sessions,
                                                      const v1::ReleaseClaimRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "claims", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::Status released = (*session)->claims().Release(
      request.name(), session::RequestKey::Of(request.request_id(), "ReleaseClaim", request),
      sessions.asker());
  if (!released.ok()) return released;
  return v1::ReleaseClaimResponse();
}

}  // namespace vantage::rpc::handlers
