// Plans the next views of several scanners. Each view counts only for what the others and the
// claims leave (algorithm.md section 11, 'Joint planning').
#ifndef VANTAGE_CORE_FLEET_JOINT_PLAN_H_
#define VANTAGE_CORE_FLEET_JOINT_PLAN_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/fleet/fleet_request.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"

namespace vantage::fleet {

// A scanner's way to a view and the time it takes.
struct Journey {
  std::optional<double> length;      // m
  std::string unreachable;           // why there is no length; empty when there is one
  std::optional<double> minutes;     // walking, setting up, scanning and waiting
  std::optional<double> per_minute;  // samples
};

struct Assignment {
  size_t scanner = 0;                     // into FleetRequest::scanners
  std::optional<size_t> view;             // into Plan::views
  std::string reason;                     // why there is no view; empty when there is one
  std::vector<size_t> waits_for;          // assignments whose scans must be in before
  std::vector<size_t> waits_for_pledged;  // the same of pledged views
};

struct JointPlan {
  // For one scanner: its views, best first, at most k. For several: the views of the assignments in
  // the order of the choice; a score counts what the views before it leave. The map of scores is
  // that of the first scanner before anything was chosen.
  planning::Plan plan;
  std::vector<Journey> journeys;        // by plan.views
  std::vector<Assignment> assignments;  // as chosen, then the scanners without a view
  double score = 0;                     // samples, of all assignments together
  // m^2 that all assignments together bring to the required density in the model; absent where that
  // of a view is not known.
  std::optional<double> model_gain;
  std::optional<double> guarantee;  // least share of the best choice's score
  std::string guarantee_reason;     // the theorem, or why there is no guarantee
};

// Runs steps A to F (algorithm.md section 6) once for each scanner model, then chooses views one at
// a time, the best of all scanners first. INVALID_ARGUMENT: the configuration or a scanner is
// impossible. RESOURCE_EXHAUSTED: as MakePlan(), for all models together. With a work limit the
// same on any number of threads.
absl::StatusOr<JointPlan> MakeJointPlan(const model::PlanningView& model,
                                        const FleetRequest& request,
                                        const planning::PlanningConfig& config,
                                        const parallel::Budget& budget,
                                        parallel::Parallel& parallel,
                                        planning::PlanProgress progress);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_JOINT_PLAN_H_
