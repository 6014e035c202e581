// How far apart two places are for somebody who walks: height does not count on one storey, and
// places on different ones are not near each other.
#ifndef VANTAGE_CORE_FLEET_HORIZONTAL_DISTANCE_H_
#define VANTAGE_CORE_FLEET_HORIZONTAL_DISTANCE_H_

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace vantage::fleet {

// m in height, more than what viewpoints on one storey differ by, and less than what is from storey
// to storey.
inline constexpr double kStoreyApart = 2.0;

inline double HorizontalDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {  // m
  if (std::abs(a.z() - b.z()) > kStoreyApart) return std::numeric_limits<double>::infinity();
  return (a - b).head<2>().norm();
}

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_HORIZONTAL_DISTANCE_H_
