#include "server/session/algorithms.h"

#include <optional>

#include "core/registration/anywhere.h"

namespace vantage {

Algorithms Algorithms::Core() {
  // A scan that came without a prior is where its targets say, or looked for everywhere; the guess
  // is where the last one was.
  const auto register_scan = [](const PlanningView& model, const Scan& scan, const PosePrior& prior,
                                std::span<const TargetTie> targets,
                                const RegistrationConfig& config,
                                Parallel& parallel) -> absl::StatusOr<RegistrationResult> {
    PosePrior start = prior;
    if (!scan.prior.has_value()) {
      const std::optional<TargetPose> pose = PoseFromTargets(targets);
      if (pose.has_value()) {
        start.T_world_scan = pose->T_world_scan;
      } else {
        auto found = RegisterAnywhere(model, scan, prior.T_world_scan, config, parallel);
        if (!found.ok() || targets.empty()) return found;
        start.T_world_scan = found->T_world_scan;
      }
    }
    return RegisterWithTargets(model, scan, start, targets, config, parallel);
  };
  return {LevelFirstScan,  register_scan, MakePlan,    EvaluateView,
          MeasureCoverage, MakeJointPlan, MeasureCover};
}

}  // namespace vantage
