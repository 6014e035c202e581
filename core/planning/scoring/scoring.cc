#include "core/planning/scoring/scoring.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/planning/scoring/patch_tree.h"
#include "core/visibility/target.h"

namespace vantage::planning {
namespace {

constexpr uint32_t kCellsBetweenPolls = 8192;

// What samples on a cell are worth.
struct SampleWorth {
  float from = 0;    // samples / m^2, from where on they count
  float factor = 1;  // by which each that counts, counts more
};

// A job is done when its surface is at D, and surface short of it is to be scanned again, however
// little it lacks. By the paper's metric what is just short is worth next to nothing, and what
// comes nearer without getting there as much as what does. So true surface that comes to D gains
// its area times at least `min_deficit_share` of D, and all of that for the last samples.
SampleWorth WorthOf(const DeficientCell& cell, const PlanningConfig& config) {
  if (cell.kind != model::SurfaceKind::kTrue) return {cell.density, 1};
  constexpr float kSmallest = 0.01F;  // of D: less is within rounding
  const float smallest = kSmallest * cell.enough;
  const float from =
      std::max(cell.density, static_cast<float>(config.min_counted_density_share) * cell.enough);
  const float lacking = std::max(cell.enough - cell.density, smallest);
  const float worth = std::max(lacking, static_cast<float>(config.min_deficit_share) * cell.enough);
  return {from, worth / std::max(cell.enough - from, smallest)};
}

}  // namespace

Scoring::Scoring(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                 const PatchSet& patches, const sensor::ScannerModel& scanner,
                 const PlanningConfig& config, parallel::Parallel& parallel,
                 const parallel::Budget& budget)
    : constraints_(scanner),
      scene_(grid, visibility::OpaqueGrid(model, {1, 2, 0}, budget), parallel, budget),
      scorer_(constraints_, scene_, model.voxel_size(),
              config.pose_sensitivity
                  ? &Sensitivity(grid, scanner, config, model.voxel_size(), parallel, budget)
                  : nullptr) {
  CellArrays cells;
  for (uint32_t i = 0; i < patches.cells.size(); ++i) {
    if (i % kCellsBetweenPolls == 0 && budget.Expired()) return;
    const DeficientCell& cell = patches.cells[i];
    const auto weight = static_cast<float>(config.weights[static_cast<size_t>(cell.kind)]);
    // A scan is scored at the middle of a voxel and recorded at its worst corner: what it is
    // expected to record is less by what that was in the scan before. Else every place would
    // promise again, for all surface below D, what it has given already.
    const SampleWorth worth = WorthOf(cell, config);
    float factor = worth.factor * weight * cell.success * cell.area / cell.spread;
    float enough = cell.enough * cell.spread;
    if (!config.density_on_false_surface && cell.kind != model::SurfaceKind::kTrue) {
      // A single sample on it is as good as all.
      factor *= enough;
      enough = 1;
    }
    if (!(factor > 0)) continue;
    const auto target = visibility::TargetOf(grid, cell.voxel, cell.normal);
    if (!target.has_value()) continue;
    cells.Add(cell.position, cell.normal, factor, worth.from * cell.spread, enough,
              scene_.ToScene(*target), i,
              std::span(patches.dropouts).subspan(cell.dropouts, cell.dropout_count));
  }
  const std::vector<uint32_t> order = PatchOrder(cells, parallel, budget);
  if (budget.Expired()) return;
  std::vector<float> factors(order.size());
  for (size_t k = 0; k < order.size(); ++k) factors[k] = cells.factor[order[k]];
  cells_ = cells.Gather(order, factors);
  finished_ = true;
}

const PoseSensitivity& Scoring::Sensitivity(const visibility::OpaqueGrid& grid,
                                            const sensor::ScannerModel& scanner,
                                            const PlanningConfig& config, double voxel,
                                            parallel::Parallel& parallel,
                                            const parallel::Budget& budget) {
  table_.emplace(grid, parallel, budget);
  // A view stands for its viewcell, grown by what a person misses it by.
  return sensitivity_.emplace(constraints_, *table_,
                              config.viewcell_size / 2 + scanner.positioning_error, voxel,
                              scene_.corner());
}

}  // namespace vantage::planning
