#include "core/planning/scoring.h"

#include "core/planning/target.h"

namespace vantage {

Scoring::Scoring(const PlanningView& model, const OpaqueGrid& grid, const PatchSet& patches,
                 const ScannerModel& scanner, const PlanningConfig& config, Parallel& parallel)
    : constraints_(scanner, config.required_density),
      scene_(grid, OpaqueGrid(model, {1, 2, 0}), parallel),
      // A view stands for its viewcell, grown by what a person misses it by.
      scorer_(constraints_, scene_, model.voxel_size(),
              config.pose_sensitivity ? config.viewcell_size / 2 + scanner.positioning_error : 0) {
  for (uint32_t i = 0; i < patches.cells.size(); ++i) {
    const NeedyCell& cell = patches.cells[i];
    const auto weight = static_cast<float>(config.weights[static_cast<size_t>(cell.kind)]);
    const float factor = weight * cell.success * cell.area;
    if (!(factor > 0)) continue;
    const auto target = TargetOf(grid, cell.voxel, cell.normal);
    if (!target.has_value()) continue;
    cells_.Add(cell.position, cell.normal, factor, cell.density, scene_.ToScene(*target), i);
  }
  cells_.Pad();
}

}  // namespace vantage
