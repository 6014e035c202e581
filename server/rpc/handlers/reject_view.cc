#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::RejectViewResponse> RejectView(const session::TenantSessions& sessions,
                                                  const v1::RejectViewRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Rejection> rejection = (*session)->rejections().Create(request);
  if (!rejection.ok()) return rejection.status();
  v1::RejectViewResponse response;
  *response.mutable_rejection() = *std::move(rejection);
  return response;
}

}  // namespace vantage::rpc::handlers
