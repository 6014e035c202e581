// Targets that a scanner saw and whose places are known. They count as evidence of the pose, as an
// inclinometer does, and are checked against the surfaces (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_TARGETS_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_TARGETS_H_

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// A sphere, checkerboard or prism.
struct TargetTie {
  std::string name;
  Eigen::Vector3d in_scan = Eigen::Vector3d::Zero();   // m, scanner frame, as it was measured
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();  // m, world frame
  double sigma = 0.002;                                // m per axis, of both together, (0, 1]
};

// INVALID_ARGUMENT names the target that is not valid.
absl::Status ValidateTargets(std::span<const TargetTie> targets);

// Whether any of them lies farther from its place, with the scan at a pose, than five sigma of it:
// a pose as far as a rival is not the scan's, then.
bool Refute(std::span<const TargetTie> targets, const Eigen::Isometry3d& T_world_scan);

// What targets say of a pose by themselves.
struct TargetPose {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  sensor::Matrix6d covariance =
      sensor::Matrix6d::Zero();  // of [rotation about world axes; translation]
  std::string worst;             // the target that fits least
  double worst_off = 0;          // m
  double worst_share = 0;        // of what its sigma allows: more than 1 is too much
};
// The pose that fits valid targets best; nothing where they leave a turn open: fewer than three, or
// all about in a line.
std::optional<TargetPose> PoseFromTargets(std::span<const TargetTie> targets);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_TARGETS_H_
