#include "core/fleet/claim_cover.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/fleet/remaining_gain.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/headings.h"
#include "core/planning/scoring/scoring.h"

namespace vantage::fleet {
namespace {

// What a scan from `position` gains in the sector, samples.
double Gain(const planning::BruteForceScorer& scorer, const Eigen::Vector3d& position,
            const planning::Sector& sector, const planning::CellArrays& cells) {
  const parallel::Budget budget = parallel::Budget::Unlimited();
  if (sector.everything()) return scorer.Score(position, cells, budget).score;
  std::vector<float> cell_scores(cells.size());
  scorer.ScoreCells(position, cells, budget, cell_scores);
  return planning::KeepSector(sector, position, cells, cell_scores);
}

}  // namespace

absl::StatusOr<CoveredView> MeasureCover(
    const model::PlanningView& model, const sensor::ScannerModel& scanner,
    const planning::PlanningConfig& config, const Eigen::Vector3d& position,
    std::span<const PledgedView> claims, parallel::Parallel& parallel,
    std::optional<double> heading, std::span<const PledgedView> made,
    std::shared_ptr<const planning::ExpectedSite> site) {
  if (!position.allFinite()) {
    return absl::InvalidArgumentError("position must be finite (m, model frame)");
  }
  if (heading.has_value() && !std::isfinite(*heading)) {
    return absl::InvalidArgumentError("heading must be finite (rad)");
  }
  const auto problem = planning::PlanningProblem::Prepare(
      {model, scanner, config, nullptr, std::move(site)}, parallel);
  if (!problem.ok()) return problem.status();
  const planning::Scoring& scoring = (*problem)->scoring();
  const parallel::Budget budget = parallel::Budget::Unlimited();

  uint64_t rays = 0;
  CoveredView covered;
  const planning::Sector sector(scanner, heading);
  RemainingGain before(scoring.cells());
  before.TakeAll(made, scoring.scene(), model.voxel_size(), budget, rays);
  const planning::CellArrays& cells = before.left();
  covered.score = Gain(scoring.scorer(), position, sector, cells);
  covered.left = covered.score;
  covered.cover.by_claim.assign(claims.size(), 0);
  if (!(covered.score > 0)) return covered;
  RemainingGain together(cells);
  for (size_t k = 0; k < claims.size(); ++k) {
    const planning::SensingConstraints constraints(claims[k].model);
    const planning::BruteForceScorer scorer(constraints, scoring.scene(), model.voxel_size());
    RemainingGain alone(cells);
    alone.Take(claims[k].position, scorer, budget, rays, claims[k].heading);
    together.Take(claims[k].position, scorer, budget, rays, claims[k].heading);
    const double taken =
        alone.Lowered(0, position, scoring.scorer(), budget, rays, heading).value_or(0);
    covered.cover.by_claim[k] = std::clamp(taken / covered.score, 0.0, 1.0);
  }
  covered.left = Gain(scoring.scorer(), position, sector, together.left());
  covered.cover.together = std::clamp(1 - covered.left / covered.score, 0.0, 1.0);
  return covered;
}

}  // namespace vantage::fleet
