// The picture of a simulated fleet's tours.
#ifndef VANTAGE_CLIENT_SIMULATION_FLEET_PICTURE_H_
#define VANTAGE_CLIENT_SIMULATION_FLEET_PICTURE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/library/client.h"
#include "client/simulation/simulated_fleet.h"
#include "client/simulation/site.h"

namespace vantage {

// Of a job that has ended, over the surface that the server has of it. `stops` in the order in
// which they came in; `summary` goes under the title.
absl::Status WriteFleetPicture(Client& client, const Site& site, const FleetResult& result,
                               const std::vector<FleetStop>& stops, int scanners,
                               const std::vector<std::string>& summary, const std::string& path);

}  // namespace vantage

#endif  // VANTAGE_CLIENT_SIMULATION_FLEET_PICTURE_H_
