// Whether a simulated job can come to anything, asked before it begins.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_ATTAINABLE_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_ATTAINABLE_H_

#include "absl/status/status.h"
#include "client/simulated_job/site.h"
#include "core/simulation/ground_truth.h"

namespace vantage::simulated_job {

// `coverage`: of the ground truth, before the first scan. INVALID_ARGUMENT: nobody who begins at
// the site's start can measure anything, or nothing at the required density (samples / m^2); all
// shares of what can be attained would be 0 of 0.
absl::Status CheckAttainable(const simulation::TrueCoverage& coverage, const Site& site,
                             double required_density);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_ATTAINABLE_H_
