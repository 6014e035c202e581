#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void GetPoseGraph(const session::TenantSessions& sessions, const v1::GetPoseGraphRequest& request,
                  std::function<void(absl::StatusOr<v1::GetPoseGraphResponse>)> done) {
  const absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.name(), "name");
  if (!session.ok()) return done(session.status());
  (*session)->DescribePoseGraph(std::move(done));
}

}  // namespace vantage::rpc::handlers
