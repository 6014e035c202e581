// The picture of a simulated fleet's tours.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_FLEET_PICTURE_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_FLEET_PICTURE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/library/client.h"
#include "client/simulated_job/simulated_fleet.h"
#include "client/simulated_job/site.h"

namespace vantage::simulated_job {

// Draws a job that has ended, over the surface that the server has. `stops` are in the order in
// which they arrived; `summary` goes under the title.
absl::Status WriteFleetPicture(client::Client& client, const Site& site, const FleetResult& result,
                               const std::vector<FleetStop>& stops, int scanners,
                               const std::vector<std::string>& summary, const std::string& path);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_FLEET_PICTURE_H_
