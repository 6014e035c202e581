// Distance from a point to a triangle. Shares no code with the tracer that scans meshes.
#ifndef VANTAGE_TESTS_CORE_MODEL_TRIANGLE_DISTANCE_H_
#define VANTAGE_TESTS_CORE_MODEL_TRIANGLE_DISTANCE_H_

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vantage::model {

inline double SegmentDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                              const Eigen::Vector3d& b) {
  const Eigen::Vector3d along = b - a;
  const double t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (p - a - t * along).norm();
}

inline double TriangleDistance(const Eigen::Vector3d& p,
                               const std::array<Eigen::Vector3d, 3>& corner) {
  const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  bool over = true;
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d& a = corner[i];
    const Eigen::Vector3d& b = corner[(i + 1) % 3];
    over = over && normal.dot((b - a).cross(p - a)) >= 0;
    nearest = std::min(nearest, SegmentDistance(p, a, b));
  }
  return over ? std::abs(normal.dot(p - corner[0])) : nearest;
}

}  // namespace vantage::model

#endif  // VANTAGE_TESTS_CORE_MODEL_TRIANGLE_DISTANCE_H_
