// A scene to scan: triangles, each with a material.
#ifndef VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_
#define VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage {

// Polished: matte seen head on, a mirror at grazing incidence (a waxed floor, a stone slab).
enum class Material : uint8_t { kMatte = 0, kGlass = 1, kMirror = 2, kDark = 3, kPolished = 4 };

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;           // m, z up
  std::vector<std::array<uint32_t, 3>> triangles;  // two-sided: winding means nothing
  std::vector<Material> material;                  // one per triangle

  Eigen::AlignedBox3d Bounds() const;
};

// Parses a PLY file (ascii or binary little-endian, float or double positions, triangle or polygon
// faces, which become fans). Every triangle is matte; triangles without area are dropped.
// INVALID_ARGUMENT names what is wrong with the file; nothing is allocated for counts that the file
// is too short for. UNIMPLEMENTED: big-endian.
absl::StatusOr<TriangleMesh> ParsePly(absl::string_view bytes);

// Reads such a file. NOT_FOUND and PERMISSION_DENIED as the file system says.
absl::StatusOr<TriangleMesh> ReadPly(const std::string& path);

}  // namespace vantage

#endif  // VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_
