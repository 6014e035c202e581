#include <utility>

#include "server/contract/resource_names.h"
#include "server/conversion/check_request.h"
#include "server/conversion/to_proto.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::DeleteSessionResponse> DeleteSession(const session::TenantSessions& sessions,
                                                        const v1::DeleteSessionRequest& request) {
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  const absl::StatusOr<std::string> id = contract::ParseSessionName(request.name(), "name");
  if (!id.ok()) return id.status();
  const absl::StatusOr<absl::Time> deleted = sessions.Delete(*id, request.request_id());
  if (!deleted.ok()) return deleted.status();
  v1::DeleteSessionResponse response;
  const absl::Duration keep = sessions.limits().keep_backups;
  if (keep > absl::ZeroDuration()) {
    *response.mutable_backups_forget_time() = conversion::WriteTime(*deleted + keep);
  }
  return response;
}

}  // namespace vantage::rpc::handlers
