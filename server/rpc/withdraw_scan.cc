#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::WithdrawScanResponse> WithdrawScan(const TenantSessions& sessions,
                                                      const v1::WithdrawScanRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  return (*session)->WithdrawScan(request);
}

}  // namespace vantage::handlers
