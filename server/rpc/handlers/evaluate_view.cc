#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void EvaluateView(const session::TenantSessions& sessions, const v1::EvaluateViewRequest& request,
                  const std::stop_token& gone,
                  std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done) {
  const auto session = FindForWork(sessions, request);
  if (!session.ok()) return done(session.status());
  (*session)->plans().EvaluateView(request, std::move(done), gone);
}

}  // namespace vantage::rpc::handlers
