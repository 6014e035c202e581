#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::CreateSessionResponse> CreateSession(SessionRegistry& sessions,
                                                        const v1::CreateSessionRequest& request,
                                                        const std::string& tenant) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return open;
  absl::StatusOr<std::shared_ptr<Session>> session = sessions.Create(request, tenant);
  if (!session.ok()) return session.status();
  v1::CreateSessionResponse response;
  *response.mutable_session() = (*session)->Describe();
  return response;
}

}  // namespace vantage::handlers
