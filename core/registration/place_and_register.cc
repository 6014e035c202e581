#include "core/registration/place_and_register.h"

#include <optional>

#include "core/registration/global_registration.h"
#include "core/registration/registration.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

absl::StatusOr<RegistrationResult> PlaceAndRegister(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& last_pose,
                                                    std::span<const TargetTie> targets,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel) {
  if (scan.prior.has_value()) {
    return RegisterWithTargets(model, scan, *scan.prior, targets, config, parallel);
  }
  sensor::PosePrior start;
  if (const std::optional<TargetPose> pose = PoseFromTargets(targets)) {
    start.T_world_scan = pose->T_world_scan;
  } else {
    auto found = RegisterGlobally(model, scan, last_pose, config, parallel);
    if (!found.ok() || targets.empty()) return found;
    start.T_world_scan = found->T_world_scan;
  }
  return RegisterWithTargets(model, scan, start, targets, config, parallel);
}

}  // namespace vantage::registration
