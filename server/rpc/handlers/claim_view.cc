// Takes a claim.
#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void ClaimView(const session::TenantSessions& sessions, const v1::ClaimViewRequest& request,
               std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return done(open);
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return done(session.status());
  absl::Status valid = conversion::CheckRequest(request);
  if (!valid.ok()) return done(valid);
  (*session)->claims().Take(request, std::move(done), sessions.asker().caller);
}

}  // namespace vantage::rpc::handlers
