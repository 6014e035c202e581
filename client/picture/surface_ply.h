// The surface export, read back for drawing.
#ifndef VANTAGE_CLIENT_PICTURE_SURFACE_PLY_H_
#define VANTAGE_CLIENT_PICTURE_SURFACE_PLY_H_

#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/picture/column_map.h"

namespace vantage::picture {

// Reads binary little-endian PLY whose vertices have x, y, z, nx, ny, nz, kind, density and area in
// any order and any scalar types, among other properties. INVALID_ARGUMENT names what is missing or
// wrong.
absl::StatusOr<std::vector<SurfaceElement>> ParseSurfacePly(absl::string_view bytes);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_SURFACE_PLY_H_
