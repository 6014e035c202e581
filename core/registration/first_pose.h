// Where a session's first scan goes, which there is no model to align to: it says where the world
// is.
#ifndef VANTAGE_CORE_REGISTRATION_FIRST_POSE_H_
#define VANTAGE_CORE_REGISTRATION_FIRST_POSE_H_

#include <Eigen/Geometry>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include "core/registration/align/targets.h"
#include "core/registration/levelling.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// What is believed of the first scan's pose: a trusted prior; else the pose that its targets give,
// trusted; else the prior as it is, if there is one. INVALID_ARGUMENT: the targets contradict each
// other.
absl::StatusOr<std::optional<sensor::PosePrior>> FirstPrior(
    const std::optional<sensor::PosePrior>& stated, std::span<const TargetTie> targets);

// The pose (scanner to world frame) of the first scan by its levelling and what is believed: a
// trusted prior's; with another one its place and heading, and the tilt that was found; without one
// the levelling's.
Eigen::Isometry3d FirstPose(const Levelling& levelling,
                            const std::optional<sensor::PosePrior>& prior);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_FIRST_POSE_H_
