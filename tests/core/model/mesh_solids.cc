#include "tests/core/model/mesh_solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "tests/core/model/triangle_distance.h"

namespace vantage::model {
MeshSolids::MeshSolids(const simulation::TriangleMesh& mesh) {
  // Vertices at one place are one.
  std::map<std::array<float, 3>, uint32_t> places;
  std::vector<uint32_t> place(mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f& v = mesh.vertices[i];
    place[i] = places.try_emplace({v.x(), v.y(), v.z()}, static_cast<uint32_t>(places.size()))
                   .first->second;
  }
  // Parts hang together by the vertices that the mesh itself shares; where it shares none, by
  // places.
  std::vector<uint32_t> of_vertex(mesh.vertices.size());
  std::iota(of_vertex.begin(), of_vertex.end(), 0);
  const bool shares = mesh.vertices.size() < 2 * mesh.triangles.size();
  if (!shares) of_vertex = place;
  std::vector<uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& triangle : mesh.triangles) {
    for (size_t i = 1; i < 3; ++i) {
      parent[root(of_vertex[triangle[i]])] = root(of_vertex[triangle[0]]);
    }
  }
  // An edge of the mesh, in the part it belongs to.
  std::map<std::array<uint32_t, 3>, int> edges;
  for (const auto& triangle : mesh.triangles) {
    const uint32_t part = root(of_vertex[triangle[0]]);
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = place[triangle[i]];
      const uint32_t b = place[triangle[(i + 1) % 3]];
      ++edges[{part, std::min(a, b), std::max(a, b)}];
    }
  }
  std::map<uint32_t, bool> closed;
  for (const auto& [edge, times] : edges) {
    const auto it = closed.try_emplace(edge[0], true).first;
    it->second = it->second && times % 2 == 0;
  }
  std::map<uint32_t, uint32_t> number;
  const Eigen::AlignedBox3d bounds = mesh.Bounds();
  low_ = bounds.min().head<2>();
  size_ = ((bounds.sizes().head<2>() / kCell).array().floor().cast<int>() + 1).matrix();
  bins_.resize(static_cast<size_t>(size_.x()) * static_cast<size_t>(size_.y()));
  for (const auto& triangle : mesh.triangles) {
    const uint32_t part = root(of_vertex[triangle[0]]);
    if (!closed[part]) continue;
    const uint32_t solid =
        number.try_emplace(part, static_cast<uint32_t>(number.size())).first->second;
    Face face{solid, {}};
    Eigen::AlignedBox2d plan;
    for (size_t i = 0; i < 3; ++i) {
      face.corner[i] = mesh.vertices[triangle[i]].cast<double>();
      plan.extend(face.corner[i].head<2>());
    }
    const auto index = static_cast<uint32_t>(faces_.size());
    if (solid >= faces_of_.size()) faces_of_.resize(solid + 1);
    faces_of_[solid].push_back(index);
    faces_.push_back(face);
    const Eigen::Vector2i first = ((plan.min() - low_) / kCell).array().floor().cast<int>();
    const Eigen::Vector2i last = ((plan.max() - low_) / kCell).array().floor().cast<int>();
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        bins_[static_cast<size_t>(y) * static_cast<size_t>(size_.x()) + static_cast<size_t>(x)]
            .push_back(index);
      }
    }
  }
  solids_ = number.size();
}

std::vector<uint32_t> MeshSolids::Containing(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = point + Eigen::Vector3d(1.07e-5, 0.93e-5, 0);
  const Eigen::Array2d cell = ((p.head<2>() - low_) / kCell).array().floor();
  if ((cell < 0).any() || cell.x() >= size_.x() || cell.y() >= size_.y()) return {};
  const size_t bin = static_cast<size_t>(cell.y()) * static_cast<size_t>(size_.x()) +
                     static_cast<size_t>(cell.x());
  std::vector<uint32_t> above;  // the solid of each face that lies above, once per face
  for (const uint32_t index : bins_[bin]) {
    const auto& [a, b, c] = faces_[index].corner;
    const auto side = [&p](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
      return (to.x() - from.x()) * (p.y() - from.y()) - (to.y() - from.y()) * (p.x() - from.x());
    };
    const double ab = side(a, b);
    const double bc = side(b, c);
    const double ca = side(c, a);
    if (!((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0))) continue;
    const double z = (bc * a.z() + ca * b.z() + ab * c.z()) / (ab + bc + ca);
    if (z > p.z()) above.push_back(faces_[index].solid);
  }
  std::sort(above.begin(), above.end());
  std::vector<uint32_t> containing;
  for (size_t i = 0; i < above.size();) {
    size_t end = i;
    while (end < above.size() && above[end] == above[i]) ++end;
    if ((end - i) % 2 == 1) containing.push_back(above[i]);
    i = end;
  }
  return containing;
}

double MeshSolids::DepthIn(uint32_t solid, const Eigen::Vector3d& point) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const uint32_t index : faces_of_[solid]) {
    nearest = std::min(nearest, TriangleDistance(point, faces_[index].corner));
  }
  return nearest;
}

}  // namespace vantage::model
