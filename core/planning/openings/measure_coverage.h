// Measures how complete a model is (algorithm.md section 7F).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_MEASURE_COVERAGE_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_MEASURE_COVERAGE_H_

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/opening.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// Measures how complete the model is, whose openings these are. CANCELLED when that was requested
// on the way.
absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         const PlanningConfig& config, Openings openings,
                                         const parallel::Cancellation& cancelled = {});
// The same, without planning: finds the openings first.
absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled = {});

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_MEASURE_COVERAGE_H_
