// Says that a scan was made whose data will come later.
#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void CreateStation(const session::TenantSessions& sessions, const v1::CreateStationRequest& request,
                   std::function<void(absl::StatusOr<v1::CreateStationResponse>)> done) {
  const auto session = FindForWork(sessions, request);
  if (!session.ok()) return done(session.status());
  (*session)->stations().Create(request, std::move(done));
}

}  // namespace vantage::rpc::handlers
