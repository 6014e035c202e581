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
  return (*session)->scans().Withdraw(request);
}

}  // namespace vantage::rpc::handlers
