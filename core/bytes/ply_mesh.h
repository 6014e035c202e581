// Triangles from PLY files.
#ifndef VANTAGE_CORE_BYTES_PLY_MESH_H_
#define VANTAGE_CORE_BYTES_PLY_MESH_H_

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::bytes {

struct PlyMesh {
  std::vector<std::array<float, 3>> vertices;  // in the file's unit
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Parses a PLY file (ascii or binary little-endian, float or double positions, triangle or polygon
// faces, which become fans). Triangles without area are dropped. INVALID_ARGUMENT names what is
// wrong with the file; nothing is allocated for counts that the file is too short for.
// UNIMPLEMENTED: big-endian.
absl::StatusOr<PlyMesh> ParsePlyMesh(absl::string_view bytes);

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_PLY_MESH_H_
