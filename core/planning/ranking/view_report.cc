#include "core/planning/ranking/view_report.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/planning/patches/space_behind.h"
#include "core/planning/ranking/gain_forecast.h"
#include "core/planning/ranking/rank_views.h"

namespace vantage::planning {
namespace {

constexpr double kClearanceLimit = 2.0;  // m, reported at most

}  // namespace

void ViewReport::Place(const Eigen::Vector3d& position, RankedView& view) const {
  view.position = position;
  view.height_over_floor = problem_.feasible().HeightOverFloor(position);
  if (const std::optional<int> storey = problem_.feasible().Storey(position)) {
    view.storey =
        problem_.feasible().floor().storeys().Describe(*storey, problem_.config().storeys);
  }
  view.floor_measured = problem_.feasible().FloorMeasured(position);
  if (problem_.BasisOf(position) == StationBasis::kExpected) {
    view.expected = ExpectedStation{std::nullopt, kStationRadius, kStationChance, std::nullopt};
    view.expected->by_site_prior = problem_.expectation()->ByPrior(position);
    if (const auto opening = problem_.expectation()->Behind(position); opening.has_value()) {
      view.expected->doorway = problem_.openings().openings[*opening].centre;
    }
  }
  view.clearance =
      ClearanceAt(problem_.grid(), problem_.model().voxel_size(), position, kClearanceLimit);
  view.travel = problem_.feasible().reach().Travel(position);
}

bool ViewReport::Exact(const Eigen::Vector3d& position, const parallel::Budget& budget,
                       parallel::Parallel& parallel, RankedView& view) const {
  const CellArrays& cells = problem_.scoring().cells();
  std::vector<float> by_cell(cells.size());
  const ViewScore score =
      problem_.scoring().scorer().ScoreCells(position, cells, budget, parallel, by_cell);
  return score.finished && Exact(position, score, std::move(by_cell), budget, parallel, view);
}

bool ViewReport::Exact(const Eigen::Vector3d& position, const ViewScore& score,
                       std::vector<float> by_cell, const parallel::Budget& budget,
                       parallel::Parallel& parallel, RankedView& view) const {
  const CellArrays& cells = problem_.scoring().cells();
  const BruteForceScorer& scorer = problem_.scoring().scorer();
  view.position = position;
  view.score = score.score;
  if (!scorer.headings().all_around()) {
    view.score = FaceHeading(scorer.headings(), problem_.scanner(), cells, by_cell, view);
  }
  view.lower = view.upper = view.score;
  SplitScore(cells, by_cell, problem_.patches(), view);
  // In the same place, what it gains on each cell.
  if (!scorer.ScoreCells(position, gains_, budget, parallel, by_cell).finished) {
    view.score_by_kind.fill(0);
    view.patch_scores.clear();
    return false;
  }
  KeepSector(Sector(problem_.scanner(), view.heading), position, gains_, by_cell);
  SetGain(gains_, problem_.patches(), by_cell, view);
  view.exact = true;
  return true;
}

bool ViewReport::DescribeGain(const parallel::Budget& budget, parallel::Parallel& parallel,
                              RankedView& view) const {
  RankedView exact = view;
  if (!Exact(view.position, budget, parallel, exact)) return false;
  view = std::move(exact);
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
    view.model_gain_upper = MostGain(view.upper);
    view.verdict = checked[k].verdict;
    Place(problem_.feasible().Centre(i), view);
    const Headings& headings = problem_.scoring().scorer().headings();
    if (checked[k].heading.has_value()) {
      view.heading = headings.Angle(*checked[k].heading);
      view.score = view.lower = view.upper = checked[k].score;
      view.exact = true;
      view.region = EquivalentRegionOf(evaluation, problem_.feasible(), i, headings,
                                       *checked[k].heading, checked[k].score);
    } else {
      view.region = EquivalentRegionOf(evaluation, problem_.feasible(), i);
    }
    view.location = DescribeLocation(problem_, view);
    DescribeGain(budget, parallel, view);
  });
  return views;
}

void ViewReport::SetGain(const CellArrays& gains, const PatchSet& patches,
                         std::span<const float> cell_gains, RankedView& view) {
  double known = 0;
  GainParts parts;
  view.gain_by_kind.fill(0);
  for (size_t i = 0; i < gains.size(); ++i) {
    const auto gain = static_cast<double>(cell_gains[i]);
    if (!(gain > 0)) continue;
    const DeficientCell cell = patches.cells[gains.cell[i]];
    if (cell.expected) {
      parts.expected += gain;
      continue;
    }
    known += gain;
    view.gain_by_kind[static_cast<size_t>(cell.kind)] += gain;
    if (cell.kind == model::SurfaceKind::kTrue) {
      parts.measured += gain;
    } else {
      (DepthWorth(cell.required, cell.enough) >= kDeep ? parts.deep : parts.hidden) += gain;
    }
  }
  view.model_gain = view.model_gain_upper = known;
  view.gain_without_hidden = known + parts.expected;
  const GainForecast forecast = ForecastGain(parts);
  view.expected_gain = forecast.expected;
  view.expected_gain_lower = forecast.lower;
  view.expected_gain_upper = forecast.upper;
}

void ViewReport::NameFallback(std::vector<RankedView>& views) {
  for (RankedView& view : views) {
    if (view.expected.has_value()) view.expected->fallback.reset();
  }
  const auto known = std::find_if(views.begin(), views.end(),
                                  [](const RankedView& v) { return !v.expected.has_value(); });
  if (known == views.end()) return;
  for (RankedView& view : views) {
    if (view.expected.has_value()) {
      view.expected->fallback = static_cast<size_t>(known - views.begin());
    }
  }
}

Plan ViewReport::Interim(const Plan& base, const Evaluation& evaluation) const {
  Plan plan;
  plan.model_version = base.model_version;
  plan.seed = base.seed;
  plan.coverage = base.coverage;
  plan.storeys = base.storeys;
  plan.required_density = base.required_density;
  plan.confidence = base.confidence;
  plan.feasible_cells = base.feasible_cells;
  plan.deficient_cells = base.deficient_cells;
  plan.surface_cube = base.surface_cube;
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
    view.model_gain_upper = MostGain(view.upper);
    const Headings& headings = problem_.scoring().scorer().headings();
    if (!headings.all_around()) view.heading = headings.Angle(estimate.heading);
    view.verdict.reason = "not checked yet";
    view.checked = false;
    Place(problem_.feasible().Centre(i), view);
    plan.views.push_back(std::move(view));
  }
  plan.optimality_gap =
      most > 0 && !plan.views.empty() ? std::clamp(1 - plan.views[0].lower / most, 0.0, 1.0) : 1;
  if (evaluation.any()) {
    plan.termination.best_upper = most;
    plan.termination.best_gain_without_hidden_upper = MostGain(most);
  }
  return plan;
}

}  // namespace vantage::planning
