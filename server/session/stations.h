// A session's pending stations: places where scans were made whose data have not come yet. Their
// whole state is in the log.
#ifndef VANTAGE_SERVER_SESSION_STATIONS_H_
#define VANTAGE_SERVER_SESSION_STATIONS_H_

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/fleet/fleet_request.h"
#include "server/session/journal.h"
#include "server/session/model_memory.h"
#include "server/session/plan_inputs.h"
#include "server/session/session_context.h"
#include "vantage/v1/fleet_service.pb.h"

namespace vantage::session {

// Thread safe; it needs no locks but the log's.
class Stations {
 public:
  Stations(SessionContext& context, ModelMemory& model);

  // Runs on the planning pool, where the scan's gain and its registration are predicted; `done` is
  // called exactly once, there or (on refusal) here. Takes the request as it came: the log stores
  // its station, and whether there is the scanner that it names is known here.
  void Create(const v1::CreateStationRequest& request,
              std::function<void(absl::StatusOr<v1::CreateStationResponse>)> done);
  // NOT_FOUND: there is none of that name, or it has ended; so below.
  absl::StatusOr<v1::Station> Get(const std::string& name) const;
  // In pages, as in Scans::List().
  absl::StatusOr<std::vector<v1::Station>> List(
      absl::string_view after, size_t limit, bool& more,
      const v1::ListStationsRequest& filter = v1::ListStationsRequest()) const;
  absl::Status Delete(const std::string& name, const RequestKey& key);

  // After a restart: ends the stations whose scans were merged before the server could say so.
  void Resume();
  // The station that a scan with a pose is of, by name; empty: none.
  std::string OfScan(const SessionState& state, const v1::Scan& scan) const;
  // Ends a station whose scan was merged.
  absl::Status Arrived(const std::string& station, const std::string& scan);

 private:
  absl::StatusOr<v1::Station> CreateNow(const v1::CreateStationRequest& request,
                                        const PlanInputs& inputs, parallel::Parallel& parallel);
  // What its scan should bring, and how likely it is lost; into `station`.
  absl::Status Forecast(const PlanInputs& inputs, const std::vector<fleet::PledgedView>& before,
                        parallel::Parallel& parallel, v1::Station& station) const;
  absl::Status End(const std::string& name, v1::StationEndReason how, const std::string& scan,
                   const RequestKey& key);

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ModelMemory& model_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_STATIONS_H_
