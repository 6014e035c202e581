// The stations of a session whose scans have not come.
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::ListStationsResponse> ListStations(const session::TenantSessions& sessions,
                                                      const v1::ListStationsRequest& request) {
  return ListOfSession<v1::ListStationsResponse>(
      sessions, request, "stations", 1000,
      [&](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.stations().List(after, limit, more, request);
      },
      [](v1::ListStationsResponse& response) { return response.mutable_stations(); });
}

}  // namespace vantage::rpc::handlers
