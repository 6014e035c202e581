#include "client/simulated_job/measured_surface.h"

namespace vantage::simulated_job {

absl::StatusOr<std::vector<picture::SurfaceElement>> MeasuredSurfaceOf(client::Client& client,
                                                                       const std::string& session) {
  v1::ExportModelRequest request;
  request.set_name(session);
  request.set_format(v1::EXPORT_FORMAT_SURFACE_PLY);
  const auto bytes = client.ExportBytes(request);
  if (!bytes.ok()) return bytes.status();
  return picture::ParseSurfacePly(*bytes);
}

}  // namespace vantage::simulated_job
