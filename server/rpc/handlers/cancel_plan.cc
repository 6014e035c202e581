// A plan is told to stop, and forgotten.
#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CancelPlanResponse> CancelPlan(const session::TenantSessions& sessions,
                                                  const v1::CancelPlanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "plans", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Plan> plan = (*session)->plans().Cancel(
      request.name(), session::RequestKey::Of(request.request_id(), "CancelPlan", request));
  if (!plan.ok()) return plan.status();
  v1::CancelPlanResponse response;
  *response.mutable_plan() = *std::move(plan);
  return response;
}

absl::StatusOr<v1::DeletePlanResponse> DeletePlan(const session::TenantSessions& sessions,
                                                  const v1::DeletePlanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "plans", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::Status deleted = (*session)->plans().Delete(
      request.name(), session::RequestKey::Of(request.request_id(), "DeletePlan", request));
  if (!deleted.ok()) return deleted;
  return v1::DeletePlanResponse();
}

}  // namespace vantage::rpc::handlers
