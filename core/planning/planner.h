// The planning steps A to F under one budget (algorithm.md section 6). Usable without a server.
#ifndef VANTAGE_CORE_PLANNING_PLANNER_H_
#define VANTAGE_CORE_PLANNING_PLANNER_H_

#include <memory>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/model/planning_view.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan.h"

namespace vantage {

// Called from the planning thread whenever the ranking improves: an unchecked or partly checked
// plan whose bounds hold. Keep it short.
using PlanProgress = absl::FunctionRef<void(const Plan&)>;

// Plans the next view. INVALID_ARGUMENT: the configuration is impossible.
// RESOURCE_EXHAUSTED: the plan would take more memory than config.memory_limit. A plan that ends
// early is not an error: its outcome and bounds say what it is worth.
absl::StatusOr<Plan> MakePlan(const PlanningView& model, const ScannerModel& scanner,
                              const PlanningConfig& config, const Budget& budget,
                              Parallel& parallel, PlanProgress progress);

// The what-if of any position: exact score, visible patches and registration verdict. `feasible`
// false comes with the reason in `why_not`.
struct ViewEvaluation {
  bool feasible = false;
  std::string why_not;
  RankedView view;
  std::vector<Patch> patches;  // those that view.patches point into
};
absl::StatusOr<ViewEvaluation> EvaluateView(const PlanningView& model, const ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            const Eigen::Vector3d& position, Parallel& parallel);

// How complete the model is, without planning.
Coverage MeasureCoverage(const PlanningView& model, const PlanningConfig& config);
// The same, incomplete when the budget expired on the way.
Coverage MeasureCoverageWithin(const PlanningView& model, const PlanningConfig& config,
                               const Budget& budget);

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_PLANNER_H_
