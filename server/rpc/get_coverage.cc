#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::GetCoverageResponse> GetCoverage(const TenantSessions& sessions,
                                                    const v1::GetCoverageRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session = FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  return (*session)->MeasureCoverage();
}

}  // namespace vantage::handlers
