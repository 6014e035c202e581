#include "client/cli/picture_walls.h"

namespace vantage::cli {

absl::StatusOr<std::vector<picture::SurfaceElement>> WallsOfStorey(client::Client& client,
                                                                   const std::string& session,
                                                                   const PictureStorey& storey) {
  v1::ExportModelRequest request;
  request.set_name(session);
  request.set_format(v1::EXPORT_FORMAT_SURFACE_PLY);
  const auto bytes = client.ExportBytes(request);
  if (!bytes.ok()) return bytes.status();
  auto surfaces = picture::ParseSurfacePly(*bytes);
  if (surfaces.ok() && storey.storey.has_value()) {
    std::erase_if(*surfaces, [&](const picture::SurfaceElement& element) {
      return !storey.HasSurface(element.position.z());
    });
  }
  return surfaces;
}

}  // namespace vantage::cli
