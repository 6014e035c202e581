// The what-if: evaluates any position, without planning.
#ifndef VANTAGE_CORE_PLANNING_EVALUATE_VIEW_H_
#define VANTAGE_CORE_PLANNING_EVALUATE_VIEW_H_

#include <Eigen/Core>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/copy_on_write_vector.h"
#include "core/planning/plan/patch.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// The exact score, visible patches and registration verdict of a position, of a scanner that sees a
// sector with the heading asked for, else with the best that registers (of all if none does). When
// `feasible` is false, `infeasible_message` gives the reason.
struct ViewEvaluation {
  bool feasible = false;
  std::string infeasible_message;
  RankedView view;
  CopyOnWriteVector<Patch> patches;  // view.patch_scores has indices into these
};
// `position` in m, model frame; `heading` in rad, counter-clockwise from +x, which says nothing of
// a scanner that turns all around. INVALID_ARGUMENT: the configuration is impossible, or position
// or heading is not finite. RESOURCE_EXHAUSTED: as MakePlan().
absl::StatusOr<ViewEvaluation> EvaluateView(const model::PlanningView& model,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            const Eigen::Vector3d& position,
                                            parallel::Parallel& parallel,
                                            std::optional<double> heading = std::nullopt);
// The same from a problem that is prepared.
absl::StatusOr<ViewEvaluation> EvaluateView(const PlanningProblem& problem,
                                            const Eigen::Vector3d& position,
                                            std::optional<double> heading = std::nullopt);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATE_VIEW_H_
