#include <utility>

#include "absl/time/time.h"
#include "server/conversion/check_request.h"
#include "server/conversion/to_proto.h"
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
  const contract::Limits& limits = sessions.limits();
  if (limits.keep_withdrawn_scans == absl::InfiniteDuration()) return response;
  const absl::Time erased =
      conversion::ReadTime(response.scan().update_time()) + limits.keep_withdrawn_scans;
  *response.mutable_erase_time() = conversion::WriteTime(erased);
  if (limits.keep_backups > absl::ZeroDuration()) {
    *response.mutable_backups_forget_time() = conversion::WriteTime(erased + limits.keep_backups);
  }
  return response;
}

}  // namespace vantage::rpc::handlers
