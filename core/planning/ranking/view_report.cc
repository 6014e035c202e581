#include "core/planning/ranking/view_report.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "core/planning/ranking/rank_views.h"

namespace vantage::planning {
namespace {

constexpr double kClearanceLimit = 2.0;  // m, reported at most

}  // namespace

void ViewReport::Place(const Eigen::Vector3d& position, RankedView& view) const {
  view.position = position;
  view.height_over_floor = problem_.feasible().HeightOverFloor(position);
  view.storey = problem_.feasible().Storey(position).value_or(0);
  view.floor_measured = problem_.feasible().FloorMeasured(position);
  view.clearance =
      ClearanceAt(problem_.grid(), problem_.model().voxel_size(), position, kClearanceLimit);
  view.travel = problem_.feasible().reach().Travel(position);
}

bool ViewReport::Exact(const Eigen::Vector3d& position, const parallel::Budget& budget,
                       RankedView& view) const {
  std::vector<float> cell_scores(problem_.scoring().cells().size());
  const ViewScore score = problem_.scoring().scorer().ScoreCells(
      position, problem_.scoring().cells(), budget, cell_scores);
  const ViewScore gain = problem_.scoring().scorer().Score(position, gains_, budget);
  if (!score.finished || !gain.finished) return false;
  view.model_gain = gain.score;
  view.score = view.lower = view.upper = score.score;
  view.exact = true;
  SplitScore(problem_.scoring().cells(), cell_scores, problem_.patches(), view);
  return true;
}

std::vector<RankedView> ViewReport::Describe(std::span<const CheckedView> checked,
                                             const Evaluation& evaluation, size_t count,
                                             const parallel::Budget& budget,
                                             parallel::Parallel& parallel) const {
  std::vector<RankedView> views(std::min(count, checked.size()));
  parallel.For(views.size(), [&](size_t k) {
    RankedView& view = views[k];
    const uint32_t i = checked[k].view;
    const ViewEstimate& estimate = evaluation.views[i];
    view.score = estimate.score;
    view.lower = estimate.lower;
    view.upper = estimate.upper;
    view.exact = estimate.exact;
    view.verdict = checked[k].verdict;
    Place(problem_.feasible().Centre(i), view);
    view.region = EquivalentRegionOf(evaluation, problem_.feasible(), i);
    view.location = DescribeLocation(problem_.model(), view.position, view.height_over_floor);
    RankedView split;
    if (Exact(view.position, budget, split)) {
      view.score_by_kind = split.score_by_kind;
      view.patch_scores = std::move(split.patch_scores);
      view.score = view.lower = view.upper = split.score;
      view.exact = true;
      view.model_gain = split.model_gain;
    }
  });
  return views;
}

Plan ViewReport::Interim(const Plan& base, const Evaluation& evaluation) const {
  Plan plan;
  plan.outcome = PlanOutcome::kViews;
  plan.message = "still evaluating: the views are not yet checked for registration";
  plan.model_version = base.model_version;
  plan.seed = base.seed;
  plan.coverage = base.coverage;
  plan.required_density = base.required_density;
  plan.confidence = base.confidence;
  plan.feasible_cells = base.feasible_cells;
  plan.deficient_cells = base.deficient_cells;
  plan.deficient_area = base.deficient_area;
  plan.seconds = base.seconds;
  plan.rays = evaluation.rays;
  double most = 0;
  for (const ViewEstimate& view : evaluation.views) most = std::max(most, view.upper);
  for (const uint32_t i :
       RankViews(evaluation, problem_.feasible(), problem_.config().candidate_separation,
                 static_cast<size_t>(problem_.config().candidates))) {
    const ViewEstimate& estimate = evaluation.views[i];
    RankedView view;
    view.score = estimate.score;
    view.lower = estimate.lower;
    view.upper = estimate.upper;
    view.exact = estimate.exact;
    view.verdict.reason = "not checked yet";
    view.checked = false;
    Place(problem_.feasible().Centre(i), view);
    plan.views.push_back(std::move(view));
  }
  plan.optimality_gap =
      most > 0 && !plan.views.empty() ? std::clamp(1 - plan.views[0].lower / most, 0.0, 1.0) : 1;
  if (evaluation.any()) plan.termination.best_upper = most;
  return plan;
}

}  // namespace vantage::planning
