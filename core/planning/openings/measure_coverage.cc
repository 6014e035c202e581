#include "core/planning/openings/measure_coverage.h"

#include <utility>

#include "absl/status/status.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/openings.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {

absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled) {
  const auto floor = FloorMap::Find(model, config.floor_z, cancelled);
  if (!floor.ok()) return floor.status();
  auto openings = FindOpenings(model, *floor, cancelled);
  if (!openings.ok()) return openings.status();
  return MeasureCoverage(model, config, *std::move(openings), cancelled);
}

absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         const PlanningConfig& config, Openings openings,
                                         const parallel::Cancellation& cancelled) {
  Coverage coverage;
  double wanted = 0;  // what is not given up
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (config.region_of_interest.has_value() &&
            !config.region_of_interest->contains(model.Centre(v))) {
          return;
        }
        const double area = surface.area;
        coverage.area[static_cast<size_t>(model::KindOf(state))] += area;
        if (state == model::VoxelState::kTrueSurface &&
            surface.density >= config.required_density) {
          coverage.area_at_density += area;
          wanted += area;
        } else if (surface.given_up) {
          coverage.area_given_up += area;
        } else {
          wanted += area;
        }
      });
  if (!whole) return absl::CancelledError("coverage");
  if (wanted > 0) coverage.estimated_coverage = coverage.area_at_density / wanted;
  coverage.openings = std::move(openings);
  return coverage;
}

}  // namespace vantage::planning
