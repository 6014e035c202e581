#include "core/planning/patches/measure_coverage.h"

#include "core/visibility/surface_walk.h"

namespace vantage::planning {

Coverage MeasureCoverage(const model::PlanningView& model, const PlanningConfig& config) {
  return MeasureCoverageWithin(model, config, parallel::Budget::Unlimited());
}

Coverage MeasureCoverageWithin(const model::PlanningView& model, const PlanningConfig& config,
                               const parallel::Budget& budget) {
  Coverage coverage;
  double all = 0;
  visibility::WalkSurface(
      model, budget,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (config.region_of_interest.has_value() &&
            !config.region_of_interest->contains(model.Centre(v))) {
          return;
        }
        const double area = surface.area;
        coverage.area[static_cast<size_t>(model::KindOf(state))] += area;
        all += area;
        if (state == model::VoxelState::kTrueSurface &&
            surface.density >= config.required_density) {
          coverage.area_at_density += area;
        } else if (surface.given_up) {
          coverage.area_given_up += area;
        }
      });
  coverage.estimated_coverage = all > 0 ? coverage.area_at_density / all : 0;
  return coverage;
}

}  // namespace vantage::planning
