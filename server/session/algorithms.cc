#include "server/session/algorithms.h"

#include <optional>

#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/registration/global_registration.h"
#include "core/registration/registration.h"

namespace vantage::session {

Algorithms Algorithms::Core() {
  // A scan that came without a prior is placed by its targets, or searched for everywhere; the
  // guess is the place of the last scan.
  const auto register_scan =
      [](const model::PlanningView& model, const sensor::Scan& scan, const sensor::PosePrior& prior,
         std::span<const registration::TargetTie> targets,
         const registration::RegistrationConfig& config,
         parallel::Parallel& parallel) -> absl::StatusOr<registration::RegistrationResult> {
    sensor::PosePrior start = prior;
    if (!scan.prior.has_value()) {
      const std::optional<registration::TargetPose> pose = registration::PoseFromTargets(targets);
      if (pose.has_value()) {
        start.T_world_scan = pose->T_world_scan;
      } else {
        auto found =
            registration::RegisterGlobally(model, scan, prior.T_world_scan, config, parallel);
        if (!found.ok() || targets.empty()) return found;
        start.T_world_scan = found->T_world_scan;
      }
    }
    return registration::RegisterWithTargets(model, scan, start, targets, config, parallel);
  };
  // Of the overloads, those that begin with the model.
  const auto make_plan = [](const model::PlanningView& model, const sensor::ScannerModel& scanner,
                            const planning::PlanningConfig& config, const parallel::Budget& budget,
                            parallel::Parallel& parallel, planning::PlanProgress progress) {
    return planning::MakePlan(model, scanner, config, budget, parallel, progress);
  };
  const auto evaluate_view =
      [](const model::PlanningView& model, const sensor::ScannerModel& scanner,
         const planning::PlanningConfig& config, const Eigen::Vector3d& position,
         parallel::Parallel& parallel, std::optional<double> heading) {
        return planning::EvaluateView(model, scanner, config, position, parallel, heading);
      };
  const auto measure_coverage = [](const model::PlanningView& model,
                                   std::span<const sensor::ScannerModel> scanners,
                                   const planning::PlanningConfig& config) {
    return planning::MeasureCoverage(model, scanners, config).value();  // nobody cancels it
  };
  return {registration::LevelFirstScan,
          register_scan,
          make_plan,
          evaluate_view,
          measure_coverage,
          planning::FindStoreys,
          fleet::MakeJointPlan,
          fleet::MeasureCover,
          planning::MakePlanChoosingSetting};
}

}  // namespace vantage::session
