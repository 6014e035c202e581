// A scene to scan: triangles, each with a material.
#ifndef VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_
#define VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace vantage {

enum class Material : uint8_t { kMatte = 0, kGlass = 1, kMirror = 2, kDark = 3 };

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;           // m, z up
  std::vector<std::array<uint32_t, 3>> triangles;  // two-sided: winding means nothing
  std::vector<Material> material;                  // one per triangle

  Eigen::AlignedBox3d Bounds() const;
};

// Reads a PLY file (ascii or binary little-endian, float or double positions, triangle or polygon
// faces). Every triangle is matte. INVALID_ARGUMENT names what is wrong with the file.
absl::StatusOr<TriangleMesh> ReadPly(const std::string& path);

}  // namespace vantage

#endif  // VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_
