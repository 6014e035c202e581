#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::CancelPlanResponse> CancelPlan(const TenantSessions& sessions,
                                                  const v1::CancelPlanRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindParent(sessions, request.name(), "plans", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Plan> plan = (*session)->CancelPlan(request.name());
  if (!plan.ok()) return plan.status();
  v1::CancelPlanResponse response;
  *response.mutable_plan() = *std::move(plan);
  return response;
}

}  // namespace vantage::handlers
