#include "core/fleet/pending_stations.h"

#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "absl/status/status.h"
#include "core/fleet/pending_surface.h"
#include "core/fleet/remaining_gain.h"
#include "core/fleet/same_sector.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/gain_cells.h"
#include "core/planning/scoring/headings.h"
#include "core/planning/scoring/scoring.h"

namespace vantage::fleet {

std::optional<size_t> StationOfScan(std::span<const PendingStation> pending,
                                    absl::string_view scanner, const Eigen::Vector3d& position,
                                    std::optional<double> heading) {
  constexpr double kFarthest = 1.0;      // m, horizontally
  constexpr double kHalfAStorey = 1.25;  // m, of the lowest
  std::optional<size_t> nearest;
  double least = kFarthest;
  for (size_t i = 0; i < pending.size(); ++i) {
    const PendingStation& station = pending[i];
    if (!station.scanner.empty() && !scanner.empty() && station.scanner != scanner) continue;
    const Eigen::Vector3d off = position - station.position;
    const double apart = off.head<2>().norm();
    if (std::abs(off.z()) > kHalfAStorey || apart > kFarthest) continue;
    if (!ShowsSameSector(station.heading, heading, station.span)) continue;
    if (nearest.has_value() && apart >= least) continue;
    nearest = i;
    least = apart;
  }
  return nearest;
}

absl::StatusOr<StationForecast> ForecastStation(
    const model::PlanningView& model, const sensor::ScannerModel& scanner,
    planning::PlanningConfig config, const Eigen::Vector3d& position, std::optional<double> heading,
    std::span<const PledgedView> before, parallel::Parallel& parallel) {
  if (!position.allFinite()) {
    return absl::InvalidArgumentError("position must be finite (m, model frame)");
  }
  if (heading.has_value() && !std::isfinite(*heading)) {
    return absl::InvalidArgumentError("heading must be finite (rad)");
  }
  // Somebody stood there, whatever a plan may count on: beyond an opening it is free as expected.
  // Model gain is of what is known all the same.
  config.station_basis = planning::StationBasis::kExpected;
  const auto prepared = planning::PlanningProblem::Prepare({model, scanner, config}, parallel);
  if (!prepared.ok()) return prepared.status();
  const planning::PlanningProblem& problem = **prepared;
  const planning::Scoring& scoring = problem.scoring();
  const parallel::Budget budget = parallel::Budget::Unlimited();
  uint64_t rays = 0;
  RemainingGain remaining(scoring.cells());
  remaining.TakeAll(before, problem.scene(), model.voxel_size(), budget, rays);
  PendingSurface surface(problem, problem.overlap(), ExpectedRooms::kLeaveOut);
  std::vector<double> by_heading;
  const planning::Headings& headings = scoring.scorer().headings();
  const bool chosen = !headings.all_around() && !heading.has_value();
  if (chosen) {
    std::vector<float> scores(remaining.left().size());
    scoring.scorer().ScoreCells(position, remaining.left(), budget, scores);
    by_heading = planning::SumByHeading(headings, position, remaining.left(), scores);
  }
  const auto judged =
      surface.Judge(position, remaining, config.registration, budget, rays, by_heading, heading);
  if (!judged.has_value()) return absl::InternalError("a check without a budget ended early");

  StationForecast forecast;
  const planning::CellArrays gains = planning::GainCells(remaining.left(), problem.patches());
  const planning::Sector sector(scanner,
                                chosen ? std::optional(headings.Angle(judged->heading)) : heading);
  std::vector<float> by_cell(gains.size());
  scoring.scorer().ScoreCells(position, gains, budget, by_cell);
  for (uint32_t i = 0; i < by_cell.size(); ++i) {
    if (problem.patches().cells[gains.cell[i]].expected) by_cell[i] = 0;
  }
  forecast.model_gain = sector.everything()
                            ? std::accumulate(by_cell.begin(), by_cell.end(), 0.0)
                            : planning::KeepSector(sector, position, gains, by_cell);
  forecast.registers = judged->verdict.registered();
  forecast.waits = !judged->waits_for.empty();
  if (!forecast.registers) {
    forecast.why_not = judged->verdict.reason;
  }
  forecast.loss_chance = !forecast.registers ? kLossOtherwise
                         : forecast.waits    ? kLossWhereItWaits
                                             : kLossWhereItRegisters;
  return forecast;
}

}  // namespace vantage::fleet
