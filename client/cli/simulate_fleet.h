// vantage simulate --scanners: the report of a simulated fleet.
#ifndef VANTAGE_CLIENT_CLI_SIMULATE_FLEET_H_
#define VANTAGE_CLIENT_CLI_SIMULATE_FLEET_H_

#include <string>

#include "absl/status/status.h"
#include "client/library/client.h"
#include "client/simulated_job/simulated_fleet.h"
#include "client/simulated_job/site.h"
#include "core/parallel/parallel.h"

namespace vantage::cli {

// Runs the job, prints a row for each scan and the figures at its end (lines of JSON, where that is
// asked for), and draws the tours into the
// folder `pictures` where that is not empty.
absl::StatusOr<simulated_job::FleetResult> SimulateFleet(client::Client& client,
                                                         const simulated_job::Site& site,
                                                         const simulated_job::FleetOptions& options,
                                                         const std::string& pictures, bool json,
                                                         parallel::Parallel& parallel);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_SIMULATE_FLEET_H_
