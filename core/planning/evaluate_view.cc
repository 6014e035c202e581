#include "core/planning/evaluate_view.h"

#include <utility>

#include "absl/status/status.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planning_estimate.h"
#include "core/planning/ranking/rank_views.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/ranking/view_report.h"
#include "core/planning/scoring/scoring.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

absl::StatusOr<ViewEvaluation> EvaluateView(const model::PlanningView& model,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config,
                                            const Eigen::Vector3d& position,
                                            parallel::Parallel& parallel) {
  if (absl::Status valid = ValidateFor(model, scanner, config); !valid.ok()) return valid;
  if (!position.allFinite()) {
    return absl::InvalidArgumentError("position must be finite (m, model frame)");
  }
  if (absl::Status fits = CheckPlanningSize(model, config); !fits.ok()) return fits;
  const parallel::Budget budget = parallel::Budget::Unlimited();
  const visibility::OpaqueGrid grid(model);
  const FeasibleViews feasible =
      FeasibleViews::Find(model, grid, scanner, config, budget, parallel);
  PatchSet patches = ExtractPatches(model, config, PatchTolerance{}, budget);
  RankPatches(config, patches);
  const Scoring scoring(model, grid, patches, scanner, config, parallel);

  ViewEvaluation evaluation;
  const FeasibleViews::CellIndex cell = feasible.CellOf(position);
  const Infeasibility why = feasible.Why(cell);
  evaluation.feasible = why == Infeasibility::kNone;
  if (!evaluation.feasible)
    evaluation.infeasible_message = InfeasibilityWords(why, scanner, config);
  RankedView& view = evaluation.view;
  const ViewReport report(model, grid, feasible, patches, scoring);
  report.Exact(position, budget, view);
  report.Place(position, view);
  view.location = DescribeLocation(model, position, view.height_over_floor);
  const Eigen::Vector3d low = cell.cast<double>() * feasible.cell_size();
  view.region.box = Region(low, Eigen::Vector3d(low.array() + feasible.cell_size()));
  view.region.volume = view.region.box.volume();
  view.region.viewcell_count = 1;
  const OverlapSurface overlap(model, grid, scoring.scene(), scanner);
  if (auto seen = overlap.Predict(position, scoring.scene(), config.registration, budget)) {
    view.verdict = std::move(seen->verdict);
  }
  evaluation.patches = std::move(patches.patches);
  return evaluation;
}

}  // namespace vantage::planning
