#include "server/session/algorithms.h"

#include "core/registration/anywhere.h"

namespace vantage {

Algorithms Algorithms::Core() {
  // A scan that came without a prior is looked for everywhere; the guess is where the last one was.
  const auto register_scan = [](const PlanningView& model, const Scan& scan, const PosePrior& prior,
                                const RegistrationConfig& config, Parallel& parallel) {
    return scan.prior.has_value()
               ? Register(model, scan, prior, config, parallel)
               : RegisterAnywhere(model, scan, prior.T_world_scan, config, parallel);
  };
  return {LevelFirstScan,  register_scan, MakePlan,    EvaluateView,
          MeasureCoverage, MakeJointPlan, MeasureCover};
}

}  // namespace vantage
