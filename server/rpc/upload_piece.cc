#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"
#include "server/session/error.h"

namespace vantage::handlers {

absl::StatusOr<v1::UploadPieceResponse> UploadPiece(const TenantSessions& sessions,
                                                    const v1::UploadPieceRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindParent(sessions, request.upload(), "uploads", "upload");
  if (!session.ok()) return session.status();
  if (!request.has_piece()) return InvalidField("piece", "is required");
  absl::StatusOr<v1::Upload> upload = (*session)->AddToUpload(
      request.upload(), &request.piece(), request.has_total() ? &request.total() : nullptr);
  if (!upload.ok()) return upload.status();
  v1::UploadPieceResponse response;
  *response.mutable_upload() = *std::move(upload);
  return response;
}

}  // namespace vantage::handlers
