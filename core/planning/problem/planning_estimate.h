// What a plan will take, before anything is begun.
#ifndef VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_
#define VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_

#include <cstdint>

#include "absl/status/status.h"
#include "core/model/view/planning_view.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// Bytes that MakePlan() needs at its peak besides the model, from the model's box and surface alone
// (as if all surface were deficient). Not below what is needed; see README.md for how far above.
uint64_t EstimatePlanningMemory(const model::PlanningView& model, const PlanningConfig& config);

// RESOURCE_EXHAUSTED, naming the limit and what to change, when that is more than
// config.memory_limit or when the box has more viewcells than can be indexed.
absl::Status CheckPlanningSize(const model::PlanningView& model, const PlanningConfig& config);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_ESTIMATE_H_
