#include <utility>

#include "server/contract/error.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::UploadPieceResponse> UploadPiece(const session::TenantSessions& sessions,
                                                    const v1::UploadPieceRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.upload(), "uploads", "upload");
  if (!session.ok()) return session.status();
  if (!request.has_piece()) return contract::InvalidField("piece", "is required");
  absl::StatusOr<v1::Upload> upload = (*session)->uploads().Add(
      request.upload(), &request.piece(), request.has_total() ? &request.total() : nullptr);
  if (!upload.ok()) return upload.status();
  v1::UploadPieceResponse response;
  *response.mutable_upload() = *std::move(upload);
  return response;
}

}  // namespace vantage::rpc::handlers
