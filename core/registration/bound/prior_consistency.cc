#include "core/registration/bound/prior_consistency.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/registration/bound/chi_square.h"

namespace vantage::registration {
namespace {

// Of the prior's variance: a direction of which the overlap leaves more says little about it.
constexpr double kMuchBetter = 0.1;
// Directions: of fewer no size can be told.
constexpr int kFewestDirections = 3;

}  // namespace

double PriorVarianceFactor(const OverlapGeometry& geometry, const Eigen::Isometry3d& T_world_scan,
                           const sensor::PosePrior& prior) {
  const Eigen::Vector3d scanner = prior.T_world_scan.translation();
  const Eigen::AngleAxisd turn(T_world_scan.linear() * prior.T_world_scan.linear().transpose());
  sensor::Vector6d off;  // as it moves the overlap's centroid
  off.head<3>() = turn.angle() * turn.axis();
  off.tail<3>() =
      T_world_scan.translation() - scanner + off.head<3>().cross(geometry.centroid() - scanner);
  // In units of the prior's sigmas.
  const sensor::Matrix6d information = geometry.FromPoseCovariance(*prior.covariance, scanner);
  const Eigen::LLT<sensor::Matrix6d> root(information);
  if (root.info() != Eigen::Success) return 1;
  const sensor::Matrix6d lower = root.matrixL();
  const sensor::Matrix6d left =
      lower.transpose() * geometry.Bound(sensor::Matrix6d::Zero()).covariance * lower;
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> known(left);
  const sensor::Vector6d sigmas = known.eigenvectors().transpose() * (lower.transpose() * off);
  double squares = 0;
  int directions = 0;
  for (Eigen::Index k = 0; k < 6; ++k) {
    if (!(known.eigenvalues()[k] < kMuchBetter)) break;  // in rising order
    squares += sigmas[k] * sigmas[k] / (1 + known.eigenvalues()[k]);
    ++directions;
  }
  if (directions < kFewestDirections || squares <= ChiSquareQuantile(directions, kNormal95)) {
    return 1;
  }
  // A prior that lies is taken to be worse than three in four draws would have it.
  return squares / ChiSquareQuantile(directions, kNormal25);
}

}  // namespace vantage::registration
