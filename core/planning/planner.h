// The planning steps A to F under one budget (algorithm.md section 6). Usable without a server.
#ifndef VANTAGE_CORE_PLANNING_PLANNER_H_
#define VANTAGE_CORE_PLANNING_PLANNER_H_

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/problem/planning_problem.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Called from the planning thread whenever the ranking improves, with a plan whose bounds hold and
// whose first view registers, if any that was checked does; the others are unchecked. It must be
// quick.
using PlanProgress = absl::FunctionRef<void(const Plan&)>;

// Plans the next view. INVALID_ARGUMENT: the configuration is impossible. RESOURCE_EXHAUSTED: the
// plan would take more memory than config.memory_limit. A plan that ends early is not an error: its
// outcome and bounds say what is known. Budgets may be overrun for the sake of an answer
// (algorithm.md section 6, 'Always an answer').
absl::StatusOr<Plan> MakePlan(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                              const PlanningConfig& config, const parallel::Budget& budget,
                              parallel::Parallel& parallel, PlanProgress progress);

// The same from a problem that is prepared: begins with step D.
Plan MakePlan(const PlanningProblem& problem, const parallel::Budget& budget,
              parallel::Parallel& parallel, PlanProgress progress);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLANNER_H_
