#include "core/planning/evaluate_view.h"

#include <utility>

#include "absl/status/status.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/view_report.h"

namespace vantage::planning {
namespace {

absl::Status CheckPosition(const Eigen::Vector3d& position) {
  if (position.allFinite()) return absl::OkStatus();
  return absl::InvalidArgumentError("position must be finite (m, model frame)");
}

}  // namespace

absl::StatusOr<ViewEvaluation> EvaluateView(const model::PlanningView& model,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            const Eigen::Vector3d& position,
                                            parallel::Parallel& parallel) {
  if (absl::Status finite = CheckPosition(position); !finite.ok()) return finite;
  const auto problem = PlanningProblem::Prepare({model, scanner, config}, parallel);
  if (!problem.ok()) return problem.status();
  return EvaluateView(**problem, position);
}

absl::StatusOr<ViewEvaluation> EvaluateView(const PlanningProblem& problem,
                                            const Eigen::Vector3d& position) {
  if (absl::Status finite = CheckPosition(position); !finite.ok()) return finite;
  const parallel::Budget budget = parallel::Budget::Unlimited();
  const FeasibleViews& feasible = problem.feasible();
  ViewEvaluation evaluation;
  const FeasibleViews::CellIndex cell = feasible.CellOf(position);
  const Infeasibility why = feasible.Why(cell);
  evaluation.feasible = why == Infeasibility::kNone;
  if (!evaluation.feasible) {
    evaluation.infeasible_message = InfeasibilityWords(why, problem.scanner(), problem.config());
  }
  RankedView& view = evaluation.view;
  const ViewReport report(problem);
  report.Exact(position, budget, view);
  report.Place(position, view);
  view.location = DescribeLocation(problem, view);
  view.region = RegionOfCell(feasible, cell);
  const auto overlap =
      OverlapSurface::Create(problem.model(), problem.grid(), problem.scene(), problem.scanner());
  if (!overlap.ok()) return overlap.status();
  if (auto seen =
          overlap->Predict(position, problem.scene(), problem.config().registration, budget)) {
    view.verdict = std::move(seen->verdict);
  }
  evaluation.patches = problem.patches().patches;
  return evaluation;
}

}  // namespace vantage::planning
