// Meshes from PLY files.
#ifndef VANTAGE_CORE_SIMULATION_MESH_PLY_H_
#define VANTAGE_CORE_SIMULATION_MESH_PLY_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

// Parses a PLY file (ascii or binary little-endian, float or double positions, triangle or polygon
// faces, which become fans). Every triangle is matte; triangles without area are dropped.
// INVALID_ARGUMENT names what is wrong with the file; nothing is allocated for counts that the file
// is too short for. UNIMPLEMENTED: big-endian.
absl::StatusOr<TriangleMesh> ParseMeshPly(absl::string_view bytes);

// Reads such a file. NOT_FOUND and PERMISSION_DENIED as the file system says.
absl::StatusOr<TriangleMesh> ReadMeshPly(const std::string& path);

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_MESH_PLY_H_
