// Scenes out of boxes, quads and cylinders.
#ifndef VANTAGE_CORE_SIMULATION_SCENES_MESH_BUILDER_H_
#define VANTAGE_CORE_SIMULATION_SCENES_MESH_BUILDER_H_

#include <Eigen/Geometry>
#include <array>

#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

// Adds shapes in a local frame (m, z up) that is placed in the scene.
class MeshBuilder {
 public:
  explicit MeshBuilder(TriangleMesh& mesh) : mesh_(mesh) {}

  // Where the local frame lies in the scene from now on.
  void SetFrame(const Eigen::Isometry3d& T_scene_local) { T_scene_local_ = T_scene_local; }
  const Eigen::Isometry3d& frame() const { return T_scene_local_; }

  // Corners in order around the quad.
  void Quad(const std::array<Eigen::Vector3d, 4>& corners, Material material = Material::kMatte);

  // All six faces of the box between two corners.
  void Box(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
           Material material = Material::kMatte);
  // A box turned by `yaw` (rad) about the upright axis through the middle of its base.
  void TurnedBox(const Eigen::Vector3d& base_middle, const Eigen::Vector3d& size, double yaw,
                 Material material = Material::kMatte);

  // Upright, closed at both ends, the upper radius may differ (0: a cone).
  void Cylinder(const Eigen::Vector3d& base_middle, double radius, double upper_radius,
                double height, int sides = 16, Material material = Material::kMatte);

 private:
  uint32_t Vertex(const Eigen::Vector3d& local);
  void Triangle(uint32_t a, uint32_t b, uint32_t c, Material material);

  TriangleMesh& mesh_;
  Eigen::Isometry3d T_scene_local_ = Eigen::Isometry3d::Identity();
};

}  // namespace vantage::simulation

#endif  // VANTAGE_CORE_SIMULATION_SCENES_MESH_BUILDER_H_
