// Where somebody would scan who knows the scene: the measure of what a plan could come to.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_ORACLE_ROUTE_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_ORACLE_ROUTE_H_

#include <Eigen/Core>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "client/simulated_job/site.h"
#include "client/simulated_job/surveyor.h"
#include "core/parallel/parallel.h"
#include "core/simulation/ground_truth.h"

namespace vantage::simulated_job {

struct OracleScan {
  int number = 0;                  // from 1, at the site's start
  Eigen::Vector3d at;              // m, scene frame
  double gain = 0;                 // m^2 that it brought to density
  simulation::TrueCoverage truth;  // afterwards
};

// The first scan at the start, then each where it truly brings most, of all allowed positions,
// until nothing is left to gain or `options.max_scans` were made. No pose is in doubt, and no
// server is asked. INVALID_ARGUMENT as CheckAttainable().
absl::Status FollowOracle(const Site& site, const JobOptions& options, parallel::Parallel& parallel,
                          absl::FunctionRef<void(const OracleScan&)> on_scan);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_ORACLE_ROUTE_H_
