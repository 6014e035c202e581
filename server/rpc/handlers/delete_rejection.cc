// Takes a refusal back.
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::DeleteRejectionResponse> DeleteRejection(
    const session::TenantSessions& sessions, const v1::DeleteRejectionRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "rejections", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::Status deleted = (*session)->rejections().Delete(
      request.name(), session::RequestKey::Of(request.request_id(), "DeleteRejection", request));
  if (!deleted.ok()) return deleted;
  return v1::DeleteRejectionResponse();
}

}  // namespace vantage::rpc::handlers
