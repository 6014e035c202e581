#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::AcceptScanResponse> AcceptScan(const session::TenantSessions& sessions,
                                                  const v1::AcceptScanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  const session::Scans::ChosenPose chosen{request.rival_pose(), request.proposed(), request.etag()};
  absl::StatusOr<v1::Scan> scan = (*session)->scans().Accept(
      request.name(), chosen, session::RequestKey::Of(request.request_id(), "AcceptScan", request));
  if (!scan.ok()) return scan.status();
  v1::AcceptScanResponse response;
  *response.mutable_scan() = *std::move(scan);
  return response;
}

}  // namespace vantage::rpc::handlers
