#include "core/registration/first_pose.h"

#include <cmath>

#include "absl/strings/str_format.h"

namespace vantage::registration {
namespace {

// rad, from +x towards +y.
double HeadingOf(const Eigen::Isometry3d& T_world_scan) {
  const Eigen::Vector3d ahead = T_world_scan.linear() * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

}  // namespace

absl::StatusOr<std::optional<sensor::PosePrior>> FirstPrior(
    const std::optional<sensor::PosePrior>& stated, std::span<const TargetTie> targets) {
  const std::optional<TargetPose> pose = PoseFromTargets(targets);
  if (!pose.has_value()) return stated;
  if (pose->worst_share > 1) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "target '%s' lies %.3f m from where the others have it; check its name and its place in "
        "the control network, or leave it out",
        pose->worst, pose->worst_off));
  }
  if (stated.has_value() && stated->trusted) return stated;
  sensor::PosePrior prior;
  prior.T_world_scan = pose->T_world_scan;
  prior.covariance = pose->covariance;
  prior.trusted = true;
  return prior;
}

Eigen::Isometry3d FirstPose(const Levelling& levelling,
                            const std::optional<sensor::PosePrior>& prior) {
  if (!prior.has_value()) return levelling.T_world_scan;
  if (prior->trusted) return prior->T_world_scan;
  Eigen::Isometry3d T_world_scan = levelling.T_world_scan;
  const double turn = HeadingOf(prior->T_world_scan) - HeadingOf(levelling.T_world_scan);
  T_world_scan.linear() =
      Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * T_world_scan.linear();
  T_world_scan.translation() = prior->T_world_scan.translation();
  return T_world_scan;
}

}  // namespace vantage::registration
