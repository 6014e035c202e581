#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::UpdateSessionResponse> UpdateSession(const session::TenantSessions& sessions,
                                                        const v1::UpdateSessionRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.session().name(), "session.name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Session> updated = (*session)->Update(request);
  if (!updated.ok()) return updated.status();
  v1::UpdateSessionResponse response;
  *response.mutable_session() = *std::move(updated);
  return response;
}

}  // namespace vantage::rpc::handlers
