#include "core/registration/align/pose_step.h"

#include <Eigen/Cholesky>

namespace vantage::registration {
namespace {

constexpr double kVagueShift = 1.0;  // m, as kVagueTurn: against thousands of samples it is nothing

}  // namespace

Eigen::Isometry3d MovedPose(const Eigen::Isometry3d& pose, const sensor::Vector6d& change,
                            const Eigen::Vector3d& about) {
  const double angle = change.head<3>().norm();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (angle > 1e-15) {
    turn = Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix();
  }
  Eigen::Isometry3d moved = pose;
  moved.linear() = Eigen::Quaterniond(turn * pose.linear()).normalized().toRotationMatrix();
  moved.translation() = turn * (pose.translation() - about) + about + change.tail<3>();
  return moved;
}

sensor::Vector6d PoseChange(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                            const Eigen::Vector3d& about) {
  const Eigen::Matrix3d turn = to.linear() * from.linear().transpose();
  const Eigen::AngleAxisd rotation(turn);
  sensor::Vector6d change;
  change << rotation.angle() * rotation.axis(),
      to.translation() - about - turn * (from.translation() - about);
  return change;
}

sensor::Matrix6d AboutOther(const Eigen::Vector3d& arm) {
  sensor::Matrix6d move = sensor::Matrix6d::Identity();
  move.bottomLeftCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  return move;
}

PriorTerm::PriorTerm(const sensor::PosePrior& prior, std::span<const TargetTie> targets)
    : pose_(prior.T_world_scan), targets_(targets) {
  information_.setZero();
  if (prior.covariance.has_value()) {
    information_ = prior.covariance->ldlt().solve(sensor::Matrix6d::Identity());
  } else {
    information_.diagonal() << Eigen::Vector3d::Constant(1 / (kVagueTurn * kVagueTurn)),
        Eigen::Vector3d::Constant(1 / (kVagueShift * kVagueShift));
  }
  if (prior.levelled_sigma.has_value()) {
    const double sigma = *prior.levelled_sigma;
    information_(0, 0) += 1 / (sigma * sigma);
    information_(1, 1) += 1 / (sigma * sigma);
  }
}

void PriorTerm::AddTo(NormalEquations& normals, const Eigen::Isometry3d& pose,
                      const Eigen::Vector3d& about) const {
  const auto add = [&](const Eigen::Isometry3d& known, const Eigen::Vector3d& at,
                       const sensor::Matrix6d& information) {
    const sensor::Vector6d change = PoseChange(known, pose, at);
    const sensor::Matrix6d move = AboutOther(at - about);
    normals.h += (move.transpose() * information * move).eval();
    normals.b += move.transpose() * information * change;
  };
  add(pose_, pose_.translation(), information_);
  if (constraint_.has_value())
    add(constraint_->T_world_scan, constraint_->about, constraint_->information);
  for (const TargetTie& target : targets_) {
    const Eigen::Vector3d at = pose * target.in_scan;
    const Eigen::Vector3d miss = at - target.in_world;
    const double weight = 1 / (target.sigma * target.sigma);
    for (int axis = 0; axis < 3; ++axis) {
      normals.Add(at - about, Eigen::Vector3d::Unit(axis), miss[axis], weight);
    }
  }
}

sensor::Vector6d SolveStep(NormalEquations& normals) {
  normals.h = sensor::Matrix6d(normals.h.selfadjointView<Eigen::Lower>());
  return -normals.h.ldlt().solve(normals.b);
}

}  // namespace vantage::registration
