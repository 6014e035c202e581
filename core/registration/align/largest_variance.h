// How far off a position may be in its worst direction, from its covariance.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_LARGEST_VARIANCE_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_LARGEST_VARIANCE_H_

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// Of a covariance, along the direction in which it is largest; rounding may not make it negative.
inline double LargestVariance(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::max(0.0, solver.eigenvalues()[2]);
}

// m, of a pose's position, [rotation; translation].
inline double LargestPositionSigma(const sensor::Matrix6d& covariance) {
  return std::sqrt(LargestVariance(covariance.bottomRightCorner<3, 3>()));
}

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_LARGEST_VARIANCE_H_
