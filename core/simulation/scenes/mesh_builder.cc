#include "core/simulation/scenes/mesh_builder.h"

#include <cmath>
#include <numbers>

namespace vantage::simulation {

uint32_t MeshBuilder::Vertex(const Eigen::Vector3d& local) {
  mesh_.vertices.push_back((T_scene_local_ * local).cast<float>());
  return static_cast<uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::Triangle(uint32_t a, uint32_t b, uint32_t c, Material material) {
  mesh_.triangles.push_back({a, b, c});
  mesh_.material.push_back(material);
}

void MeshBuilder::Quad(const std::array<Eigen::Vector3d, 4>& corners, Material material) {
  const uint32_t first = Vertex(corners[0]);
  for (size_t i = 1; i < corners.size(); ++i) Vertex(corners[i]);
  Triangle(first, first + 1, first + 2, material);
  Triangle(first, first + 2, first + 3, material);
}

void MeshBuilder::Box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Material material) {
  const auto first = static_cast<uint32_t>(mesh_.vertices.size());
  for (int corner = 0; corner < 8; ++corner) {
    Vertex({(corner & 1) != 0 ? high.x() : low.x(), (corner & 2) != 0 ? high.y() : low.y(),
            (corner & 4) != 0 ? high.z() : low.z()});
  }
  constexpr std::array<std::array<uint32_t, 4>, 6> kFaces = {
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (const auto& [a, b, c, d] : kFaces) {
    Triangle(first + a, first + b, first + c, material);
    Triangle(first + a, first + c, first + d, material);
  }
}

void MeshBuilder::TurnedBox(const Eigen::Vector3d& base_middle, const Eigen::Vector3d& size,
                            double yaw, Material material) {
  const Eigen::Isometry3d outer = T_scene_local_;
  T_scene_local_ =
      outer * Eigen::Translation3d(base_middle) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  Box({-0.5 * size.x(), -0.5 * size.y(), 0}, {0.5 * size.x(), 0.5 * size.y(), size.z()}, material);
  T_scene_local_ = outer;
}

void MeshBuilder::Cylinder(const Eigen::Vector3d& base_middle, double radius, double upper_radius,
                           double height, int sides, Material material) {
  const uint32_t below = Vertex(base_middle);
  const uint32_t above = Vertex(base_middle + Eigen::Vector3d(0, 0, height));
  const auto first = static_cast<uint32_t>(mesh_.vertices.size());
  for (int i = 0; i < sides; ++i) {
    const double angle = 2 * std::numbers::pi * i / sides;
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
    Vertex(base_middle + radius * out);
    Vertex(base_middle + upper_radius * out + Eigen::Vector3d(0, 0, height));
  }
  for (int i = 0; i < sides; ++i) {
    const auto low = first + 2 * static_cast<uint32_t>(i);
    const auto next = first + 2 * static_cast<uint32_t>((i + 1) % sides);
    Triangle(below, next, low, material);
    Triangle(low, next, next + 1, material);
    if (upper_radius > 0) {
      Triangle(low, next + 1, low + 1, material);
      Triangle(above, low + 1, next + 1, material);
    }
  }
}

}  // namespace vantage::simulation
