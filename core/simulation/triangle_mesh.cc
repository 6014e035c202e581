#include "core/simulation/triangle_mesh.h"

namespace vantage::simulation {

Eigen::AlignedBox3d TriangleMesh::Bounds() const {
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3f& vertex : vertices) bounds.extend(vertex.cast<double>());
  return bounds;
}

}  // namespace vantage::simulation
