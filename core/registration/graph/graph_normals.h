// The normal equations of all poses of a graph, sparse, and columns of their inverse.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_GRAPH_NORMALS_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_GRAPH_NORMALS_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/registration/graph/residuals.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// At given poses. Held nodes have no unknowns: their covariance is zero.
class GraphNormals {
 public:
  // `held` has an entry for each pose.
  GraphNormals(std::span<const PoseTerm> terms, std::span<const Eigen::Isometry3d> poses,
               const std::vector<bool>& held);

  // The normal matrix is positive definite, and not by rounding alone. Else nothing else may be
  // asked.
  bool solvable() const { return solvable_; }
  // The node that is held least; of equations that are not solvable it is one that nothing holds.
  size_t weakest() const { return weakest_; }
  // The changes of all poses that lead to the minimum, as far as it is quadratic.
  std::vector<sensor::Vector6d> Step() const;
  // Covariances of each pose with that of `node`: rows are the other's.
  std::vector<sensor::Matrix6d> Column(size_t node) const;

 private:
  static constexpr Eigen::Index kNone = -1;
  std::vector<Eigen::Index> at_;  // by node: the first of its six unknowns
  Eigen::Index unknowns_ = 0;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd scale_;  // of unknowns, to equations with a diagonal of ones
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  bool solvable_ = false;
  size_t weakest_ = 0;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_GRAPH_NORMALS_H_
