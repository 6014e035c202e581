// Reads a station.
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::GetStationResponse> GetStation(const session::TenantSessions& sessions,
                                                  const v1::GetStationRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "stations", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Station> station = (*session)->stations().Get(request.name());
  if (!station.ok()) return station.status();
  v1::GetStationResponse response;
  *response.mutable_station() = *std::move(station);
  return response;
}

}  // namespace vantage::rpc::handlers
