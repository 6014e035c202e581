#include "core/registration/graph/least_squares.h"

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace vantage::registration {
namespace {

// Quaternion (x, y, z, w), then translation.
using PoseNumbers7 = std::array<double, 7>;

PoseNumbers7 Numbers(const Eigen::Isometry3d& pose) {
  PoseNumbers7 numbers{};
  Eigen::Map<Eigen::Quaterniond> turn(numbers.data());
  turn = Eigen::Quaterniond(pose.linear()).normalized();
  Eigen::Map<Eigen::Vector3d>(numbers.data() + 4) = pose.translation();
  return numbers;
}

Eigen::Isometry3d PoseOf(const double* numbers) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Map<const Eigen::Quaterniond>(numbers).normalized().toRotationMatrix();
  pose.translation() = Eigen::Map<const Eigen::Vector3d>(numbers + 4);
  return pose;
}

// How the seven numbers change with a change of the pose, which is about world axes.
using Lift = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;
Lift LiftAt(const double* numbers) {
  const Eigen::Map<const Eigen::Vector3d> v(numbers);
  Lift lift = Lift::Zero();
  lift.topLeftCorner<3, 3>() = 0.5 * (numbers[3] * Eigen::Matrix3d::Identity() - CrossMatrix(v));
  lift.block<1, 3>(3, 0) = -0.5 * v.transpose();
  lift.bottomRightCorner<3, 3>().setIdentity();
  return lift;
}
// The reverse, of changes that keep the quaternion's length.
Eigen::Matrix<double, 6, 7, Eigen::RowMajor> LowerAt(const double* numbers) {
  Eigen::Matrix<double, 6, 7, Eigen::RowMajor> lower = LiftAt(numbers).transpose();
  lower.topRows<3>() *= 4;  // columns of the quaternion's part have a length of a half
  return lower;
}

class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* change, double* moved) const override {
    const PoseNumbers7 numbers =
        Numbers(ChangedPose(PoseOf(x), Eigen::Map<const sensor::Vector6d>(change)));
    std::copy(numbers.begin(), numbers.end(), moved);
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    const Lift lift = LiftAt(x);
    std::copy(lift.data(), lift.data() + lift.size(), jacobian);
    return true;
  }
  bool Minus(const double* y, const double* x, double* change) const override {
    const sensor::Vector6d difference = PoseDifference(PoseOf(x), PoseOf(y));
    std::copy(difference.data(), difference.data() + 6, change);
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    const auto lower = LowerAt(x);
    std::copy(lower.data(), lower.data() + lower.size(), jacobian);
    return true;
  }
};

class TermCost final : public ceres::CostFunction {
 public:
  // Poses that are held are no parameters.
  TermCost(const PoseTerm& term, const std::vector<bool>& held,
           const std::vector<Eigen::Isometry3d>& poses)
      : term_(term) {
    const bool is_link = term.kind == PoseTerm::Kind::kLink;
    known_ = {poses[term.a], poses[is_link ? term.b : term.a]};
    term_.a = 0;
    term_.b = 1;
    if (!held[term.a]) parameters_.push_back(0);
    if (is_link && !held[term.b]) parameters_.push_back(1);
    set_num_residuals(term.size());
    mutable_parameter_block_sizes()->assign(parameters_.size(), 7);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    std::array<Eigen::Isometry3d, 2> poses = known_;
    for (size_t k = 0; k < parameters_.size(); ++k) poses[parameters_[k]] = PoseOf(parameters[k]);
    const Residual residual = ResidualOf(term_, poses);
    Eigen::Map<Eigen::VectorXd>(residuals, term_.size()) = residual.value;
    if (jacobians == nullptr) return true;
    for (size_t k = 0; k < parameters_.size(); ++k) {
      if (jacobians[k] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>>(jacobians[k],
                                                                            term_.size(), 7) =
          (parameters_[k] == 0 ? residual.by_a : residual.by_b) * LowerAt(parameters[k]);
    }
    return true;
  }

 private:
  PoseTerm term_;
  std::array<Eigen::Isometry3d, 2> known_;
  std::vector<size_t> parameters_;  // 0: a, 1: b
};

}  // namespace

FitOutcome FitPoses(std::span<const PoseTerm> terms, const std::vector<bool>& held,
                    std::vector<Eigen::Isometry3d>& poses) {
  std::vector<PoseNumbers7> numbers;
  numbers.reserve(poses.size());
  for (const Eigen::Isometry3d& pose : poses) numbers.push_back(Numbers(pose));
  PoseManifold manifold;
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  bool any = false;
  for (size_t i = 0; i < poses.size(); ++i) {
    if (held[i]) continue;
    problem.AddParameterBlock(numbers[i].data(), 7, &manifold);
    any = true;
  }
  if (!any) return {true, 0};
  for (const PoseTerm& term : terms) {
    std::vector<double*> blocks;
    if (!held[term.a]) blocks.push_back(numbers[term.a].data());
    if (term.kind == PoseTerm::Kind::kLink && !held[term.b]) {
      blocks.push_back(numbers[term.b].data());
    }
    if (blocks.empty()) continue;
    problem.AddResidualBlock(new TermCost(term, held, poses), nullptr, blocks);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Eigen's own factorisation: CHOLMOD's would depend on which BLAS a machine has.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // Residuals are in sigmas and unknowns in metres and radians. It stops a thousandth of a sigma
  // from the minimum or nearer; the caller's last steps go to where rounding ends them.
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.initial_trust_region_radius = 1e8;  // starts are near: hardly damped
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (size_t i = 0; i < poses.size(); ++i) {
    if (!held[i]) poses[i] = PoseOf(numbers[i].data());
  }
  return {summary.termination_type == ceres::CONVERGENCE,
          static_cast<int>(summary.iterations.size())};
}

}  // namespace vantage::registration
