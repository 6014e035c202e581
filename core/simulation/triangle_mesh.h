// A scene to scan: triangles, each with a material.
#ifndef VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_
#define VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace vantage::simulation {

// Polished: matte seen head on, a mirror at grazing incidence (a waxed floor, a stone slab).
enum class Material : uint8_t { kMatte = 0, kGlass = 1, kMirror = 2, kDark = 3, kPolished = 4 };

struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;           // m, z up
  std::vector<std::array<uint32_t, 3>> triangles;  // two-sided: winding means nothing
  std::vector<Material> material;                  // one per triangle

  Eigen::AlignedBox3d Bounds() const;
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_TRIANGLE_MESH_H_
