#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

void EvaluateView(const TenantSessions& sessions, const v1::EvaluateViewRequest& request,
                  std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return done(open);
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return done(session.status());
  (*session)->EvaluateView(request, std::move(done));
}

}  // namespace vantage::handlers
