// Takes a claim.
#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void ClaimView(const session::TenantSessions& sessions, const v1::ClaimViewRequest& request,
               const std::stop_token& gone,
               std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done) {
  const auto session = FindForWork(sessions, request);
  if (!session.ok()) return done(session.status());
  (*session)->claims().Take(request, std::move(done), sessions.asker().caller, gone);
}

}  // namespace vantage::rpc::handlers
