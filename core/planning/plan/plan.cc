#include "core/planning/plan/plan.h"

namespace vantage::planning {

Plan BeginPlan(const model::PlanningView& model, const PlanningConfig& config) {
  Plan plan;
  plan.model_version = model.version();
  plan.seed = config.seed;
  plan.required_density = config.required_density;
  plan.confidence = config.confidence;
  return plan;
}

}  // namespace vantage::planning
