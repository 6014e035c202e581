#include "core/planning/patches/measure_coverage.h"

#include <optional>

#include "absl/status/status.h"
#include "core/planning/patches/skyline.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {

absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled) {
  Coverage coverage;
  double all = 0;
  std::optional<Skyline> skyline = Skyline::Of(model, cancelled);
  if (!skyline) return absl::CancelledError("coverage");
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (config.region_of_interest.has_value() &&
            !config.region_of_interest->contains(model.Centre(v))) {
          return;
        }
        if (model::IsFalseSurface(state) && skyline->InSky(v, surface.normal)) return;
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
  if (!whole) return absl::CancelledError("coverage");
  if (all > 0) coverage.estimated_coverage = coverage.area_at_density / all;
  return coverage;
}

}  // namespace vantage::planning
