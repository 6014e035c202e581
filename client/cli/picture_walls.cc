#include "client/cli/picture_walls.h"

#include "client/simulated_job/measured_surface.h"

namespace vantage::cli {

absl::StatusOr<std::vector<picture::SurfaceElement>> WallsOfStorey(client::Client& client,
                                                                   const std::string& session,
                                                                   const PictureStorey& storey) {
  auto surfaces = simulated_job::MeasuredSurfaceOf(client, session);
  if (surfaces.ok() && storey.storey.has_value()) {
    std::erase_if(*surfaces, [&](const picture::SurfaceElement& element) {
      return !storey.HasSurface(element.position.z());
    });
  }
  return surfaces;
}

}  // namespace vantage::cli
