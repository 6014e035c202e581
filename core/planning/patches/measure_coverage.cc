#include "core/planning/patches/measure_coverage.h"

#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "core/planning/patches/skyline.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

// The figures of surface that is met voxel by voxel.
class CoverageSum {
 public:
  void Add(model::VoxelState state, const model::SurfaceVoxel& surface, double required_density) {
    const double area = surface.area;
    figures_.area[static_cast<size_t>(model::KindOf(state))] += area;
    all_ += area;
    if (state == model::VoxelState::kTrueSurface && surface.density >= required_density) {
      figures_.area_at_density += area;
    } else if (surface.given_up) {
      figures_.area_given_up += area;
    }
  }
  CoverageFigures Figures() const {
    CoverageFigures figures = figures_;
    if (all_ > 0) figures.estimated_coverage = figures.area_at_density / all_;
    return figures;
  }

 private:
  CoverageFigures figures_;
  double all_ = 0;  // m^2
};

}  // namespace

absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled) {
  CoverageSum all;
  std::vector<CoverageSum> in_region(config.regions.size());
  std::optional<Skyline> skyline = Skyline::Of(model, cancelled);
  if (!skyline) return absl::CancelledError("coverage");
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const std::optional<Requirement> required = config.RequiredAt(model.Centre(v));
        if (!required.has_value()) return;
        if (model::IsFalseSurface(state) && skyline->InSky(v, surface.normal)) return;
        all.Add(state, surface, required->density);
        if (required->region.has_value()) {
          in_region[*required->region].Add(state, surface, required->density);
        }
      });
  if (!whole) return absl::CancelledError("coverage");
  Coverage coverage{all.Figures(), {}};
  for (size_t i = 0; i < in_region.size(); ++i) {
    const RequiredRegion& region = config.regions[i];
    coverage.regions.push_back(
        {in_region[i].Figures(), region.name, region.density.value_or(config.required_density)});
  }
  return coverage;
}

}  // namespace vantage::planning
