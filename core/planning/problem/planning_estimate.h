// Estimates a plan's memory before it begins.
#ifndef VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_
#define VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/model/view/planning_view.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// Upper bound of the bytes that MakePlan() needs at its peak besides the model, from the number of
// its surface voxels and the plan of its box only, as if all surface were deficient and all of the
// plan were floor, as far as there is surface for it.
uint64_t EstimatePlanningMemory(const model::PlanningView& model, const PlanningConfig& config);

// RESOURCE_EXHAUSTED when the estimate exceeds config.memory_limit or there may be more
// viewcells than can be indexed; the message names the limit and what to change.
absl::Status CheckPlanningSize(const model::PlanningView& model, const PlanningConfig& config);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_
