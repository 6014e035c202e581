#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CreatePlanResponse> CreatePlan(const session::TenantSessions& sessions,
                                                  const v1::CreatePlanRequest& request) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return open;
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Plan> plan = (*session)->plans().Create(request);
  if (!plan.ok()) return plan.status();
  v1::CreatePlanResponse response;
  *response.mutable_plan() = *std::move(plan);
  return response;
}

}  // namespace vantage::rpc::handlers
