// One Gauss-Newton step of a pose: normal equations, prior knowledge, robust weights.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_POSE_STEP_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_POSE_STEP_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "core/registration/align/targets.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// One sigma of the rotation of a prior without a covariance, rad. It keeps directions that nothing
// constrains where they are, and is wider than the rotation of any start (12 degrees, 0.2 rad).
inline constexpr double kVagueTurn = 0.3;

// A pose change about a fixed point: [rotation; translation].
Eigen::Isometry3d MovedPose(const Eigen::Isometry3d& pose, const sensor::Vector6d& change,
                            const Eigen::Vector3d& about);
// The change that leads from `from` to `to`, about a point (small rotations).
sensor::Vector6d PoseChange(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                            const Eigen::Vector3d& about);

// What makes of a pose change about a point the same change about one that lies `arm` (m) from it;
// of its covariance C that is M C M^T.
sensor::Matrix6d AboutOther(const Eigen::Vector3d& arm);

// Normal equations of a Gauss-Newton step about a point.
struct NormalEquations {
  sensor::Matrix6d h = sensor::Matrix6d::Zero();
  sensor::Vector6d b = sensor::Vector6d::Zero();
  size_t count = 0;

  void Add(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal, double residual, double w) {
    sensor::Vector6d row;
    row << arm.cross(normal), normal;
    h.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
    b += (w * residual) * row;
    ++count;
  }
  void operator+=(const NormalEquations& other) {
    h += other.h;
    b += other.b;
    count += other.count;
  }
};

// Holds a pose, in the directions that have information, about a point.
struct PoseConstraint {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  Eigen::Vector3d about = Eigen::Vector3d::Zero();
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
};

// What is known of the pose beforehand: a guess about the prior's scanner position, an
// inclinometer, targets.
class PriorTerm {
 public:
  PriorTerm(const sensor::PosePrior& prior, std::span<const TargetTie> targets);
  void Constrain(const PoseConstraint& constraint) { constraint_ = constraint; }
  void AddTo(NormalEquations& normals, const Eigen::Isometry3d& pose,
             const Eigen::Vector3d& about) const;

 private:
  Eigen::Isometry3d pose_;
  sensor::Matrix6d information_;
  std::optional<PoseConstraint> constraint_;
  std::span<const TargetTie> targets_;  // of the caller, who keeps them
};

// The change that solves the equations.
sensor::Vector6d SolveStep(NormalEquations& normals);

// Tukey's weight of a residual, 0 beyond `scale`.
inline double Tukey(double residual, double scale) {
  const double ratio = residual / scale;
  if (std::abs(ratio) >= 1) return 0;
  const double rest = 1 - ratio * ratio;
  return rest * rest;
}

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_POSE_STEP_H_
