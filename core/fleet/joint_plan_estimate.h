// What a joint plan will take, before anything is begun.
#ifndef VANTAGE_CORE_FLEET_JOINT_PLAN_ESTIMATE_H_
#define VANTAGE_CORE_FLEET_JOINT_PLAN_ESTIMATE_H_

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "core/model/view/planning_view.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::fleet {

// As planning::EstimatePlanningMemory(), bytes, for scanners of so many models (at least 1): each
// has its own views, patch cells and map of scores.
uint64_t EstimateJointPlanMemory(const model::PlanningView& model,
                                 const planning::PlanningConfig& config, size_t scanner_models);

// As planning::CheckPlanningSize(): each scanner model has an equal share of config.memory_limit.
absl::Status CheckJointPlanSize(const model::PlanningView& model,
                                const planning::PlanningConfig& config, size_t scanner_models);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_JOINT_PLAN_ESTIMATE_H_
