#include <utility>

#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void CompareScanPoses(const session::TenantSessions& sessions,
                      const v1::CompareScanPosesRequest& request,
                      std::function<void(absl::StatusOr<v1::CompareScanPosesResponse>)> done) {
  if (absl::Status open = sessions.CheckTakesWork(); !open.ok()) return done(open);
  const auto session = FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return done(session.status());
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return done(valid);
  (*session)->pose_comparisons().Compare(request, std::move(done));
}

}  // namespace vantage::rpc::handlers
