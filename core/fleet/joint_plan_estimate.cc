#include "core/fleet/joint_plan_estimate.h"

#include "core/planning/problem/planning_estimate.h"

namespace vantage::fleet {

uint64_t EstimateJointPlanMemory(const model::PlanningView& model,
                                 const planning::PlanningConfig& config, size_t scanner_models) {
  return scanner_models * planning::EstimatePlanningMemory(model, config);
}

absl::Status CheckJointPlanSize(const model::PlanningView& model,
                                const planning::PlanningConfig& config, size_t scanner_models) {
  planning::PlanningConfig one = config;
  one.memory_limit /= scanner_models;
  return planning::CheckPlanningSize(planning::PlanningSize(model, one), one);
}

}  // namespace vantage::fleet
