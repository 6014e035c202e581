// The surface of a job that a picture is drawn over.
#ifndef VANTAGE_CLIENT_CLI_PICTURE_WALLS_H_
#define VANTAGE_CLIENT_CLI_PICTURE_WALLS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/picture_storey.h"
#include "client/library/client.h"
#include "client/picture/surface_ply.h"

namespace vantage::cli {

// What the model of `session` (resource name) has on a storey, or all of it. FAILED_PRECONDITION:
// no scan is in the model.
absl::StatusOr<std::vector<picture::SurfaceElement>> WallsOfStorey(client::Client& client,
                                                                   const std::string& session,
                                                                   const PictureStorey& storey);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_PICTURE_WALLS_H_
