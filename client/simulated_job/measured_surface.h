// The surface that a session's model has, for pictures.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_MEASURED_SURFACE_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_MEASURED_SURFACE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/library/client.h"
#include "client/picture/surface_ply.h"

namespace vantage::simulated_job {

// `session`: its resource name. FAILED_PRECONDITION: no scan is in its model.
absl::StatusOr<std::vector<picture::SurfaceElement>> MeasuredSurfaceOf(client::Client& client,
                                                                       const std::string& session);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_MEASURED_SURFACE_H_
