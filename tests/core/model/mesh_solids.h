// Which places lie inside the solids of a mesh: by counting faces above them. Shares no code with
// the model, nor with the tracer that scans the mesh.
#ifndef VANTAGE_TESTS_CORE_MODEL_MESH_SOLIDS_H_
#define VANTAGE_TESTS_CORE_MODEL_MESH_SOLIDS_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/simulation/triangle_mesh.h"

namespace vantage::model {

// A solid is a connected part of the mesh each of whose edges belongs to an even number of its
// triangles: it has an inside. Parts that have none (panes, sheets, floors) are left out. Solids
// may overlap.
class MeshSolids {
 public:
  explicit MeshSolids(const simulation::TriangleMesh& mesh);

  size_t solids() const { return solids_; }
  // The solids that a point lies in. Points exactly above an edge are moved by 10 um.
  std::vector<uint32_t> Containing(const Eigen::Vector3d& point) const;
  // m from a point inside a solid to the nearest of its faces.
  double DepthIn(uint32_t solid, const Eigen::Vector3d& point) const;

 private:
  static constexpr double kCell = 0.1;  // m, of the bins that triangles are sorted into, in plan

  struct Face {
    uint32_t solid = 0;
    std::array<Eigen::Vector3d, 3> corner;
  };
  std::vector<Face> faces_;
  std::vector<std::vector<uint32_t>> faces_of_;  // by solid
  std::vector<std::vector<uint32_t>> bins_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  size_t solids_ = 0;
};

}  // namespace vantage::model

#endif  // VANTAGE_TESTS_CORE_MODEL_MESH_SOLIDS_H_
