#include <optional>
#include <utility>

#include "absl/time/time.h"
#include "server/conversion/check_request.h"
#include "server/conversion/to_proto.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::RejectViewResponse> RejectView(const session::TenantSessions& sessions,
                                                  const v1::RejectViewRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  v1::Rejection wanted;
  *wanted.mutable_position() = request.position();
  wanted.set_radius_m(conversion::ReadRadius(request));
  wanted.set_reason(request.reason());
  std::optional<absl::Duration> ttl;
  if (request.has_ttl()) ttl = absl::Seconds(conversion::ReadDuration(request.ttl()));
  absl::StatusOr<v1::Rejection> rejection = (*session)->rejections().Create(
      wanted, ttl, session::RequestKey::Of(request.request_id(), "RejectView", request));
  if (!rejection.ok()) return rejection.status();
  v1::RejectViewResponse response;
  *response.mutable_rejection() = *std::move(rejection);
  return response;
}

}  // namespace vantage::rpc::handlers
