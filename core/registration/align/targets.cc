#include "core/registration/align/targets.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace vantage::registration {

absl::Status ValidateTargets(std::span<const TargetTie> targets) {
  constexpr size_t kMostTargets = 1000;  // in one scan; a request's worth, not a list of points
  if (targets.size() > kMostTargets) {
    return absl::InvalidArgumentError(
        absl::StrCat("targets: ", targets.size(), " targets, at most ", kMostTargets, " count"));
  }
  for (const TargetTie& target : targets) {
    if (!target.in_scan.allFinite() || !target.in_world.allFinite() ||
        !(target.sigma > 0 && target.sigma <= 1)) {
      return absl::InvalidArgumentError(
          absl::StrCat("targets: '", target.name, "' needs finite places and a sigma in (0, 1] m"));
    }
  }
  return absl::OkStatus();
}

bool Refute(std::span<const TargetTie> targets, const Eigen::Isometry3d& T_world_scan) {
  // Of all three axes together: chance is one in 1e5.
  constexpr double kFarOff = 5;
  return std::any_of(targets.begin(), targets.end(), [&](const TargetTie& target) {
    return (T_world_scan * target.in_scan - target.in_world).norm() > kFarOff * target.sigma;
  });
}

std::optional<TargetPose> PoseFromTargets(std::span<const TargetTie> targets) {
  // rad, one sigma, 3 degrees: the alignment's first stage does not bridge more, so that beyond it
  // they are as good as in a line.
  constexpr double kMostTurn = 0.05;
  constexpr double kWorstSigmas =
      5;  // that the worst of up to a thousand targets may be off: 1 in 1e3
  if (targets.size() < 3) return std::nullopt;
  // As if all were equally good: those of one site are.
  Eigen::Matrix3Xd from(3, targets.size());
  Eigen::Matrix3Xd to(3, targets.size());
  for (size_t i = 0; i < targets.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = targets[i].in_scan;
    to.col(static_cast<Eigen::Index>(i)) = targets[i].in_world;
  }
  TargetPose pose;
  pose.T_world_scan.matrix() = Eigen::umeyama(from, to, false);
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  for (const TargetTie& target : targets) {
    const Eigen::Vector3d arm = pose.T_world_scan.linear() * target.in_scan;
    Eigen::Matrix<double, 3, 6> moved;       // of the target, by the pose
    moved << 0, arm.z(), -arm.y(), 1, 0, 0,  //
        -arm.z(), 0, arm.x(), 0, 1, 0,       //
        arm.y(), -arm.x(), 0, 0, 0, 1;
    information += moved.transpose() * moved / (target.sigma * target.sigma);
    const double off = (pose.T_world_scan * target.in_scan - target.in_world).norm();
    const double share = off / (kWorstSigmas * target.sigma);
    if (share <= pose.worst_share) continue;
    pose.worst = target.name;
    pose.worst_off = off;
    pose.worst_share = share;
  }
  const Eigen::LDLT<sensor::Matrix6d> solver(information);
  if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
  pose.covariance = solver.solve(sensor::Matrix6d::Identity());
  const double turn2 = pose.covariance.topLeftCorner<3, 3>().trace();
  if (!(turn2 >= 0 && turn2 <= kMostTurn * kMostTurn)) return std::nullopt;
  return pose;
}

}  // namespace vantage::registration
