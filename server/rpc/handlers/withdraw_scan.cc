#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::WithdrawScanResponse> WithdrawScan(const session::TenantSessions& sessions,
                                                      const v1::WithdrawScanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<session::Scans::Withdrawn> withdrawn = (*session)->scans().Withdraw(
      request.name(), session::RequestKey::Of(request.request_id(), "WithdrawScan", request));
  if (!withdrawn.ok()) return withdrawn.status();
  v1::WithdrawScanResponse response;
  *response.mutable_scan() = std::move(withdrawn->scan);
  for (std::string& scan : withdrawn->dependents) response.add_dependent_scans(std::move(scan));
  return response;
}

}  // namespace vantage::rpc::handlers
