#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CreateSessionResponse> CreateSession(const session::TenantSessions& sessions,
                                                        const v1::CreateSessionRequest& request) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return open;
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<std::shared_ptr<session::Session>> session = sessions.Create(request);
  if (!session.ok()) return session.status();
  v1::CreateSessionResponse response;
  *response.mutable_session() = (*session)->Describe();
  return response;
}

}  // namespace vantage::rpc::handlers
