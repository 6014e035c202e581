// Surfaces as points with noisy normals; the directions that each leaves open are known without
// computation.
#ifndef VANTAGE_TESTS_CORE_REGISTRATION_SHAPE_H_
#define VANTAGE_TESTS_CORE_REGISTRATION_SHAPE_H_

#include <Eigen/Core>
#include <cmath>
#include <random>
#include <vector>

#include "core/registration/bound/error_bound.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

inline constexpr double kShapeSigma = 0.003;  // m, of each point along its normal

// Points with noisy normals: `noise` rad per tangent direction.
class Shape {
 public:
  Shape(double noise, unsigned seed) : noise_(noise), random_(seed) {}

  void Add(const Eigen::Vector3d& p, const Eigen::Vector3d& n) {
    const Eigen::Vector3d e(gauss_(random_), gauss_(random_), gauss_(random_));
    points_.push_back(
        {p, (n + noise_ * (e - e.dot(n) * n)).normalized(), kShapeSigma * kShapeSigma, 1.0, 0.0});
  }
  // A rectangle spanned by two edges from a corner, at 5 cm spacing.
  Shape& Rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                   const Eigen::Vector3d& v, const Eigen::Vector3d& normal) {
    const int across = static_cast<int>(std::lround(u.norm() / 0.05));
    const int up = static_cast<int>(std::lround(v.norm() / 0.05));
    for (int i = 0; i < across; ++i) {
      for (int j = 0; j < up; ++j)
        Add(corner + u * (i + 0.5) / across + v * (j + 0.5) / up, normal);
    }
    return *this;
  }
  const std::vector<Constraint>& points() const { return points_; }
  OverlapGeometry Geometry(double assumed_noise = sensor::Radians(2)) const {
    return {points_, assumed_noise, RegistrationConfig()};
  }

 private:
  double noise_;
  std::mt19937_64 random_;
  std::normal_distribution<double> gauss_;
  std::vector<Constraint> points_;
};

inline const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
inline const Eigen::Vector3d kY = Eigen::Vector3d::UnitY();
inline const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

inline Shape CorridorShape(double noise, unsigned seed) {
  Shape shape(noise, seed);
  shape.Rectangle({-4, -1, 0}, 8 * kX, 2 * kY, kZ);
  shape.Rectangle({-4, -1, 0}, 8 * kX, 2.5 * kZ, kY);
  shape.Rectangle({-4, 1, 0}, 8 * kX, 2.5 * kZ, -kY);
  return shape;
}

}  // namespace vantage::registration

#endif  // VANTAGE_TESTS_CORE_REGISTRATION_SHAPE_H_
