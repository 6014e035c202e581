#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CancelPlanResponse> CancelPlan(const session::TenantSessions& sessions,
                                                  const v1::CancelPlanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "plans", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Plan> plan = (*session)->plans().Cancel(request.name());
  if (!plan.ok()) return plan.status();
  v1::CancelPlanResponse response;
  *response.mutable_plan() = *std::move(plan);
  return response;
}

}  // namespace vantage::rpc::handlers
