#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::SetScanPoseResponse> SetScanPose(const session::TenantSessions& sessions,
                                                    const v1::SetScanPoseRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Scan> scan = (*session)->scans().SetPose(
      request.name(), request.prior(), request.use() == v1::POSE_USE_AS_IS,
      session::RequestKey::Of(request.request_id(), "SetScanPose", request));
  if (!scan.ok()) return scan.status();
  v1::SetScanPoseResponse response;
  *response.mutable_scan() = *std::move(scan);
  return response;
}

}  // namespace vantage::rpc::handlers
