// Gives an upload up.
#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::AbortUploadResponse> AbortUpload(const session::TenantSessions& sessions,
                                                    const v1::AbortUploadRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "uploads", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Upload> upload = (*session)->uploads().Abort(
      request.name(), session::RequestKey::Of(request.request_id(), "AbortUpload", request));
  if (!upload.ok()) return upload.status();
  v1::AbortUploadResponse response;
  *response.mutable_upload() = *std::move(upload);
  return response;
}

}  // namespace vantage::rpc::handlers
