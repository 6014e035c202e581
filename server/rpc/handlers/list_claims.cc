// The claims of a session.
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::GetClaimResponse> GetClaim(const session::TenantSessions& sessions,
                                              const v1::GetClaimRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "claims", "name");
  if (!session.ok()) return session.status();
  return (*session)->claims().Get(request.name());
}

absl::StatusOr<v1::ListClaimsResponse> ListClaims(const session::TenantSessions& sessions,
                                                  const v1::ListClaimsRequest& request) {
  return ListOfSession<v1::ListClaimsResponse>(
      sessions, request, "claims", 1000,
      [&](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.claims().List(after, limit, more, request);
      },
      [](v1::ListClaimsResponse& response) { return response.mutable_claims(); });
}

}  // namespace vantage::rpc::handlers
