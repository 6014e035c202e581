#include "core/planning/planner.h"
#include "core/planning/surface_walk.h"

namespace vantage {

Coverage MeasureCoverage(const PlanningView& model, const PlanningConfig& config) {
  return MeasureCoverageWithin(model, config, Budget::Unlimited());
}

Coverage MeasureCoverageWithin(const PlanningView& model, const PlanningConfig& config,
                               const Budget& budget) {
  Coverage coverage;
  double all = 0;
  WalkSurface(
      model, budget, [&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel& surface) {
        if (config.region_of_interest.has_value() &&
            !config.region_of_interest->contains(model.Centre(v))) {
          return;
        }
        const double area = surface.area;
        coverage.area[static_cast<size_t>(KindOf(state))] += area;
        all += area;
        if (state == VoxelState::kTrueSurface && surface.density >= config.required_density) {
          coverage.area_at_density += area;
        } else if (surface.given_up) {
          coverage.area_given_up += area;
        }
      });
  coverage.estimated_coverage = all > 0 ? coverage.area_at_density / all : 0;
  return coverage;
}

}  // namespace vantage
