#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CreatePlanResponse> CreatePlan(const session::TenantSessions& sessions,
                                                  const v1::CreatePlanRequest& request) {
  const auto session = FindForWork(sessions, request);
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Plan> plan = (*session)->plans().Create(request);
  if (!plan.ok()) return plan.status();
  v1::CreatePlanResponse response;
  *response.mutable_plan() = *std::move(plan);
  return response;
}

}  // namespace vantage::rpc::handlers
