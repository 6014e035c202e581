#include <utility>

#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::GetCoverageResponse> GetCoverage(const session::TenantSessions& sessions,
                                                    const v1::GetCoverageRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  return (*session)->MeasureCoverage();
}

}  // namespace vantage::rpc::handlers
