// Points spread over the triangles of a prior.
#ifndef VANTAGE_CORE_SITE_PRIOR_MESH_SAMPLES_H_
#define VANTAGE_CORE_SITE_PRIOR_MESH_SAMPLES_H_

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/prior_pose.h"

namespace vantage::site_prior {

// Points at most `spacing` (m) apart on all triangles, and the surface that each stands for.
// fn(p, normal): m and unit, both in the model frame; the side of the normal means nothing.
template <typename Fn>
void ForEachMeshSample(const PriorMesh& mesh, const PriorPose& pose, double spacing, Fn&& fn) {
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = pose.ToModel(mesh.vertices[triangle[0]].template cast<double>());
    const Eigen::Vector3d u = pose.ToModel(mesh.vertices[triangle[1]].template cast<double>()) - a;
    const Eigen::Vector3d v = pose.ToModel(mesh.vertices[triangle[2]].template cast<double>()) - a;
    const Eigen::Vector3d normal = u.cross(v);
    const double twice = normal.norm();
    if (!(twice > 0)) continue;
    const Eigen::Vector3d unit = normal / twice;
    const int n = std::max(1, static_cast<int>(std::ceil(u.norm() / spacing)));
    for (int i = 0; i <= n; ++i) {
      const double s = static_cast<double>(i) / n;
      const double left = 1 - s;
      const int m = std::max(1, static_cast<int>(std::ceil(left * v.norm() / spacing)));
      for (int j = 0; j <= m; ++j) fn(Eigen::Vector3d(a + s * u + left * j / m * v), unit);
    }
  }
}

// At least as many as ForEachMeshSample() makes, and for long ones not twice as many. `scale`: of
// the pose. A double, since slivers make more than can be counted: it is asked before any is made.
inline double MostMeshSamples(const PriorMesh& mesh, double scale, double spacing) {
  double samples = 0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
    const Eigen::Vector3d u = scale * (mesh.vertices[triangle[1]].cast<double>() - a);
    const Eigen::Vector3d v = scale * (mesh.vertices[triangle[2]].cast<double>() - a);
    const double rows = std::max(1.0, std::ceil(u.norm() / spacing)) + 1;
    // A row is (1 - i / n) |v| long, and half of that in the mean.
    samples += rows * (2 + v.norm() / spacing / 2);
  }
  return samples;
}

// The area of all triangles, m2.
inline double AreaOf(const PriorMesh& mesh) {
  double area = 0;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[triangle[0]].cast<double>();
    const Eigen::Vector3d u = mesh.vertices[triangle[1]].cast<double>() - a;
    const Eigen::Vector3d v = mesh.vertices[triangle[2]].cast<double>() - a;
    area += u.cross(v).norm() / 2;
  }
  return area;
}

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_MESH_SAMPLES_H_
