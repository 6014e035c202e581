// How far apart two places are for somebody who walks: height does not count.
#ifndef VANTAGE_CORE_FLEET_HORIZONTAL_DISTANCE_H_
#define VANTAGE_CORE_FLEET_HORIZONTAL_DISTANCE_H_

#include <Eigen/Core>

namespace vantage::fleet {

inline double HorizontalDistance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {  // m
  return (a - b).head<2>().norm();
}

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_HORIZONTAL_DISTANCE_H_
