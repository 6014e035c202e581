// vantage simulate --scanners: the report of a simulated fleet.
#ifndef VANTAGE_CLIENT_CLI_SIMULATE_FLEET_H_
#define VANTAGE_CLIENT_CLI_SIMULATE_FLEET_H_

#include <string>

#include "absl/status/status.h"
#include "client/library/client.h"
#include "client/simulation/simulated_fleet.h"
#include "client/simulation/site.h"
#include "core/parallel/parallel.h"

namespace vantage {

// Runs the job, prints a row for each scan and the figures at its end, and draws the tours into the
// folder `pictures` where that is not empty.
absl::StatusOr<FleetResult> SimulateFleet(Client& client, const Site& site,
                                          const FleetOptions& options, const std::string& pictures,
                                          Parallel& parallel);

}  // namespace vantage

#endif  // VANTAGE_CLIENT_CLI_SIMULATE_FLEET_H_
