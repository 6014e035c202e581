// Keeps a claim.
#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::RenewClaimResponse> RenewClaim(const session::TenantSessions& sessions,
                                                  const v1::RenewClaimRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "claims", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Claim> claim = (*session)->claims().Renew(
      request.name(), conversion::ReadTtl(request),
      session::RequestKey::Of(request.request_id(), "RenewClaim", request), sessions.asker());
  if (!claim.ok()) return claim.status();
  v1::RenewClaimResponse response;
  *response.mutable_claim() = *std::move(claim);
  return response;
}

}  // namespace vantage::rpc::handlers
