// Says that a scan was made whose data will come later.
#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void CreateStation(const session::TenantSessions& sessions, const v1::CreateStationRequest& request,
                   std::function<void(absl::StatusOr<v1::CreateStationResponse>)> done) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return done(open);
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return done(session.status());
  absl::Status valid = conversion::CheckRequest(request);
  if (!valid.ok()) return done(valid);
  (*session)->stations().Create(request, std::move(done));
}

}  // namespace vantage::rpc::handlers
