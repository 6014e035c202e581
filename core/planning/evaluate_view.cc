#include "core/planning/evaluate_view.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/parallel/parallel.h"
#include "core/planning/expectation/brick_edit.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/target_advice.h"
#include "core/planning/ranking/view_report.h"

namespace vantage::planning {
namespace {

absl::Status CheckFinite(const Eigen::Vector3d& position, std::optional<double> heading) {
  if (!position.allFinite()) {
    return absl::InvalidArgumentError("position must be finite (m, model frame)");
  }
  if (heading.has_value() && !std::isfinite(*heading)) {
    return absl::InvalidArgumentError("heading must be finite (rad)");
  }
  return absl::OkStatus();
}

// The same heading in [0, 2 pi), rad.
double Turned(double heading) {
  const double turned = heading - 2 * sensor::kPi * std::floor(heading / (2 * sensor::kPi));
  return turned < 2 * sensor::kPi ? turned : 0;
}

}  // namespace

absl::StatusOr<ViewEvaluation> EvaluateView(const model::PlanningView& model,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            const Eigen::Vector3d& position,
                                            parallel::Parallel& parallel,
                                            std::optional<double> heading) {
  if (absl::Status finite = CheckFinite(position, heading); !finite.ok()) return finite;
  const auto problem = PlanningProblem::Prepare({model, scanner, config}, parallel);
  if (!problem.ok()) return problem.status();
  return EvaluateView(**problem, position, heading);
}

absl::StatusOr<ViewEvaluation> EvaluateView(const PlanningProblem& problem,
                                            const Eigen::Vector3d& position,
                                            std::optional<double> heading) {
  if (absl::Status finite = CheckFinite(position, heading); !finite.ok()) return finite;
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
  const OverlapSurface& overlap = problem.overlap();
  const CellArrays& cells = problem.scoring().cells();
  const Headings& headings = problem.scoring().scorer().headings();
  const registration::RegistrationConfig& registration = problem.config().registration;
  std::vector<float> cell_scores(cells.size());
  const ViewScore score =
      problem.scoring().scorer().ScoreCells(position, cells, budget, cell_scores);
  std::optional<OverlapSurface::Seen> seen;
  if (headings.all_around() || heading.has_value()) {
    seen = overlap.Predict(position, problem.scene(), registration, budget, nullptr, heading);
    if (!headings.all_around()) view.heading = Turned(*heading);
  } else {
    seen = overlap.PredictBest(position, SumByHeading(headings, position, cells, cell_scores),
                               problem.scene(), registration, budget);
    if (seen.has_value()) view.heading = headings.Angle(seen->heading);
  }
  if (seen.has_value()) view.verdict = std::move(seen->verdict);
  // A single voxel may be unknown where much is seen all the same.
  if (view.verdict.overlap_share <= 0 &&
      NothingKnown(problem.view().State(problem.view().At(position)))) {
    view.verdict.outcome = registration::RegistrationOutcome::kDoubtful;
    view.verdict.bases = {registration::RegistrationBasis::kOverlap};
    view.verdict.reason =
        "no scan has seen into this place, so that nothing can be said of a scan from there";
    view.verdict.remedy = "scan from a place that sees into it first";
  }
  view.position = position;
  uint64_t rays = 0;
  view.targets = FindTargets(problem, view, nullptr, budget, rays);
  parallel::Serial serial;
  report.Exact(position, score, std::move(cell_scores), budget, serial, view);
  report.Place(position, view);
  view.location = DescribeLocation(problem, view);
  view.region = RegionOfCell(feasible, cell);
  evaluation.patches = problem.patches().patches;
  return evaluation;
}

}  // namespace vantage::planning
