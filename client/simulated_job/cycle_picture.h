// A cycle of a job as a picture, from answers of the public API.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_CYCLE_PICTURE_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_CYCLE_PICTURE_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/library/client.h"
#include "client/picture/job_picture.h"
#include "client/simulated_job/simulated_job.h"

namespace vantage::simulated_job {

// Draws the job after `cycle`, whose plan must be full: exports the surfaces, writes `path` (PNG).
// `stations` are all scans so far, this one included.
absl::Status WriteCyclePicture(client::Client& client, const std::string& session, const Site& site,
                               const Cycle& cycle,
                               const std::vector<picture::JobPicture::Station>& stations,
                               const std::string& path);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_CYCLE_PICTURE_H_
