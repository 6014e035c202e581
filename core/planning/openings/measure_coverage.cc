#include "core/planning/openings/measure_coverage.h"

#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/openings.h"
#include "core/planning/openings/standing_reach.h"
#include "core/planning/patches/skyline.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

bool AtDensity(model::VoxelState state, const model::SurfaceVoxel& surface, double required) {
  return state == model::VoxelState::kTrueSurface && surface.density >= required;
}

// The figures of surface that is met voxel by voxel.
class CoverageSum {
 public:
  // `in_reach()`: whether any place brings the surface to that density.
  template <typename InReach>
  void Add(model::VoxelState state, const model::SurfaceVoxel& surface, double required_density,
           InReach&& in_reach) {
    const double area = surface.area;
    figures_.area[static_cast<size_t>(model::KindOf(state))] += area;
    if (AtDensity(state, surface, required_density)) {
      figures_.area_at_density += area;
      wanted_ += area;
    } else if (surface.given_up) {
      figures_.area_given_up += area;
    } else if (!in_reach()) {
      figures_.area_out_of_reach += area;
    } else {
      wanted_ += area;
    }
  }
  CoverageFigures Figures() const {
    CoverageFigures figures = figures_;
    if (wanted_ > 0) figures.estimated_coverage = figures.area_at_density / wanted_;
    return figures;
  }

 private:
  CoverageFigures figures_;
  double wanted_ = 0;  // m^2 that are at density, or neither given up nor out of reach
};

}  // namespace

absl::StatusOr<CoveredSite> MeasureSite(const model::PlanningView& model,
                                        std::span<const sensor::ScannerModel> scanners,
                                        const PlanningConfig& config,
                                        const parallel::Cancellation& cancelled) {
  if (const uint64_t bytes = FloorColumns::Bytes(model.bounds()); bytes > config.memory_limit) {
    return absl::ResourceExhaustedError(absl::StrFormat(
        "coverage: the floors of a model as wide as this one would take about %.2f GB of memory, "
        "more than the %.2f GB that they may take: use larger voxels, split the site, or allow "
        "more (memory_limit)",
        static_cast<double>(bytes) / 1e9, static_cast<double>(config.memory_limit) / 1e9));
  }
  const auto floor = FloorMap::Find(model, config.floor_z, cancelled);
  if (!floor.ok()) return floor.status();
  auto openings = FindOpenings(model, *floor, cancelled);
  if (!openings.ok()) return openings.status();
  auto coverage = MeasureCoverage(model, scanners, config, *floor, *std::move(openings), cancelled);
  if (!coverage.ok()) return coverage.status();
  return CoveredSite{*std::move(coverage), floor->storeys().DescribeAll(config.storeys)};
}

absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         std::span<const sensor::ScannerModel> scanners,
                                         const PlanningConfig& config,
                                         const parallel::Cancellation& cancelled) {
  auto site = MeasureSite(model, scanners, config, cancelled);
  if (!site.ok()) return site.status();
  return std::move(site->coverage);
}

absl::StatusOr<Coverage> MeasureCoverage(const model::PlanningView& model,
                                         std::span<const sensor::ScannerModel> scanners,
                                         const PlanningConfig& config, const FloorMap& floor,
                                         Openings openings,
                                         const parallel::Cancellation& cancelled) {
  CoverageSum all;
  std::vector<CoverageSum> in_region(config.regions.size());
  std::optional<Skyline> skyline = Skyline::Of(model, cancelled);
  if (!skyline) return absl::CancelledError("coverage");
  std::optional<StandingReach> reach = StandingReach::Of(model, floor, scanners, config, cancelled);
  if (!reach) return absl::CancelledError("coverage");
  const bool whole = visibility::WalkSurface(
      model, cancelled,
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const std::optional<Requirement> required = config.RequiredAt(model.Centre(v));
        if (!required.has_value()) return;
        if (model::IsFalseSurface(state) && skyline->InSky(v, surface.normal)) return;
        // Outdoors much is behind eaves, ridges and edges, as seen from all floor.
        const auto in_reach = [&] {
          return reach->Has(v, surface, required->density) &&
                 (!skyline->any_open() || reach->Sees(v, surface, required->density));
        };
        all.Add(state, surface, required->density, in_reach);
        if (required->region.has_value()) {
          in_region[*required->region].Add(state, surface, required->density, in_reach);
        }
      });
  if (!whole) return absl::CancelledError("coverage");
  Coverage coverage{all.Figures(), {}, std::move(openings)};
  for (size_t i = 0; i < in_region.size(); ++i) {
    const RequiredRegion& region = config.regions[i];
    coverage.regions.push_back(
        {in_region[i].Figures(), region.name, region.density.value_or(config.required_density)});
  }
  return coverage;
}

double AreaAtDensity(const model::PlanningView& model, const PlanningConfig& config) {
  double area = 0;
  visibility::WalkSurface(
      model, parallel::Cancellation(),
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const std::optional<Requirement> required = config.RequiredAt(model.Centre(v));
        if (required.has_value() && AtDensity(state, surface, required->density)) {
          area += surface.area;
        }
      });
  return area;
}

}  // namespace vantage::planning
