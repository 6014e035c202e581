// The places that people refused.
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::ListRejectionsResponse> ListRejections(
    const session::TenantSessions& sessions, const v1::ListRejectionsRequest& request) {
  return ListOfSession<v1::ListRejectionsResponse>(
      sessions, request, "rejections", 1000,
      [](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.rejections().List(after, limit, more);
      },
      [](v1::ListRejectionsResponse& response) { return response.mutable_rejections(); });
}

}  // namespace vantage::rpc::handlers
