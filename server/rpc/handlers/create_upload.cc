#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CreateUploadResponse> CreateUpload(const session::TenantSessions& sessions,
                                                      const v1::CreateUploadRequest& request) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return open;
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  absl::Status valid = conversion::CheckRequest(request, sessions.limits());
  if (!valid.ok()) return valid;
  absl::StatusOr<v1::Upload> upload = (*session)->uploads().Create(request);
  if (!upload.ok()) return upload.status();
  v1::CreateUploadResponse response;
  *response.mutable_upload() = *std::move(upload);
  return response;
}

absl::StatusOr<v1::GetUploadResponse> GetUpload(const session::TenantSessions& sessions,
                                                const v1::GetUploadRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "uploads", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Upload> upload = (*session)->uploads().Get(request.name());
  if (!upload.ok()) return upload.status();
  v1::GetUploadResponse response;
  *response.mutable_upload() = *std::move(upload);
  return response;
}

absl::StatusOr<v1::ListUploadsResponse> ListUploads(const session::TenantSessions& sessions,
                                                    const v1::ListUploadsRequest& request) {
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::ListUploadsResponse> listed = ListOfSession<v1::ListUploadsResponse>(
      sessions, request, "uploads", 1000,
      [&](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.uploads().List(request, after, limit, more);
      },
      [](v1::ListUploadsResponse& response) { return response.mutable_uploads(); });
  if (listed.ok()) listed->set_max_file_size_bytes(sessions.limits().file_bytes);
  return listed;
}

}  // namespace vantage::rpc::handlers
