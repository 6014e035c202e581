#include "server/session/algorithms.h"

#include <optional>

#include "core/fleet/look_ahead.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/registration/place_and_register.h"

namespace vantage::session {

Algorithms Algorithms::Core() {
  // Of the overloads, those that begin with the model.
  const auto make_plan = [](const model::PlanningView& model, const sensor::ScannerModel& scanner,
                            const planning::PlanningConfig& config, const parallel::Budget& budget,
                            parallel::Parallel& parallel, planning::PlanProgress progress) {
    return fleet::MakePlanLookingAhead(model, scanner, config, budget, parallel, progress);
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
          registration::PlaceAndRegister,
          make_plan,
          evaluate_view,
          measure_coverage,
          planning::FindStoreys,
          fleet::MakeJointPlan,
          fleet::MeasureCover,
          fleet::ForecastStation,
          planning::MakePlanChoosingSetting};
}

}  // namespace vantage::session
