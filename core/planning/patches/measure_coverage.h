// How complete a model is, measured.
#ifndef VANTAGE_CORE_PLANNING_PATCHES_MEASURE_COVERAGE_H_
#define VANTAGE_CORE_PLANNING_PATCHES_MEASURE_COVERAGE_H_

#include <optional>

#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// How complete the model is, without planning.
Coverage MeasureCoverage(const model::PlanningView& model, const PlanningConfig& config);
// The same; nothing when the budget expired on the way.
std::optional<Coverage> MeasureCoverageWithin(const model::PlanningView& model,
                                              const PlanningConfig& config,
                                              const parallel::Budget& budget);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_MEASURE_COVERAGE_H_
