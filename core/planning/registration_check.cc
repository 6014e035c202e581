#include "core/planning/registration_check.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/planning/brute_force.h"
#include "core/planning/surface_walk.h"
#include "core/planning/target.h"
#include "core/registration/prediction.h"

namespace vantage {
namespace {

constexpr size_t kElements = 16000;
constexpr size_t kBatch = 4;  // candidates checked at a time, whatever the number of threads

ScannerModel AnyIncidence(ScannerModel scanner) {
  scanner.max_incidence = kPi / 2 - 1e-3;
  return scanner;
}

// Directions that a scan measures: what a scan returns indoors, where every ray meets something.
double DirectionsOf(const ScannerModel& scanner) {
  return scanner.azimuth_span / scanner.azimuth_step *
         ((scanner.elevation_max - scanner.elevation_min) / scanner.elevation_step);
}

}  // namespace

OverlapSurface::OverlapSurface(const PlanningView& model, const OpaqueGrid& grid,
                               const OcclusionScene& scene, const ScannerModel& scanner,
                               const Budget& budget)
    : voxel_(model.voxel_size()), scanner_(scanner), constraints_(AnyIncidence(scanner)) {
  size_t total = 0;
  WalkSurface(model, budget, [&](const VoxelIndex&, VoxelState state, const SurfaceVoxel&) {
    total += state == VoxelState::kTrueSurface;
  });
  const size_t stride = std::max<size_t>(1, (total + kElements - 1) / kElements);
  weight_ = static_cast<double>(stride);
  size_t at = 0;
  std::vector<Eigen::Vector3f> vain;
  WalkSurface(model, budget,
              [&](const VoxelIndex& v, VoxelState state, const SurfaceVoxel& surface) {
                if (state != VoxelState::kTrueSurface || at++ % stride != 0 || !(surface.area > 0))
                  return;
                const auto target = TargetOf(grid, v, surface.normal);
                if (!target.has_value()) return;
                vain.clear();
                for (const VainLook& look : model.VainLooks(v)) vain.push_back(look.from);
                cells_.Add(surface.centroid, surface.normal, surface.area, 0,
                           std::numeric_limits<float>::max(), scene.ToScene(*target),
                           static_cast<uint32_t>(samples_.size()), vain);
                samples_.push_back(surface.samples);
              });
  cells_.Pad();
}

CellArrays OverlapSurface::Thinned(const CellArrays& cells, std::span<const uint32_t> indices,
                                   std::span<const float> areas) const {
  CellArrays thinned;
  const auto stride = static_cast<size_t>(weight_);
  for (size_t k = 0; k < indices.size(); k += stride) {
    const size_t i = indices[k];
    thinned.Add({cells.x[i], cells.y[i], cells.z[i]}, {cells.nx[i], cells.ny[i], cells.nz[i]},
                areas[k], 0, std::numeric_limits<float>::max(),
                {cells.tx[i], cells.ty[i], cells.tz[i]}, cells.cell[i], cells.VainOf(i));
  }
  thinned.Pad();
  return thinned;
}

std::optional<OverlapSurface::Seen> OverlapSurface::Predict(const Eigen::Vector3d& view,
                                                            const OcclusionScene& scene,
                                                            const RegistrationConfig& config,
                                                            const Budget& budget,
                                                            const CellArrays* expected) const {
  const BruteForceScorer scorer(constraints_, scene, voxel_);
  Seen seen;
  std::vector<OverlapElement> overlap;
  std::vector<float> samples;
  const auto add = [&](const CellArrays& cells, const uint32_t* model_samples) {
    samples.resize(cells.size());
    const ViewScore score = scorer.ScoreCells(view, cells, budget, samples);
    seen.rays += score.rays;
    for (size_t i = 0; score.finished && i < samples.size(); ++i) {
      if (samples[i] <= 0) continue;
      overlap.push_back({{cells.x[i], cells.y[i], cells.z[i]},
                         {cells.nx[i], cells.ny[i], cells.nz[i]},
                         samples[i],
                         model_samples != nullptr ? model_samples[i] : 1});
    }
    return score.finished;
  };
  if (!add(cells_, samples_.data())) return std::nullopt;
  if (expected != nullptr && !add(*expected, nullptr)) return std::nullopt;
  seen.verdict =
      PredictRegistration(overlap, weight_, DirectionsOf(scanner_), view, scanner_, config);
  return seen;
}

RegistrationCheck CheckRegistration(const OverlapSurface& surface, const OcclusionScene& scene,
                                    std::span<const uint32_t> candidates,
                                    std::span<const Eigen::Vector3d> views, size_t wanted,
                                    const RegistrationConfig& config, const Budget& budget,
                                    Parallel& parallel) {
  RegistrationCheck check;
  size_t count = 0;
  for (size_t begin = 0; begin < candidates.size(); begin += count) {
    if (check.registrable.size() >= wanted) break;
    if (check.rays >= budget.work_limit || budget.Expired()) return check;
    const uint64_t affordable = (budget.work_limit - check.rays) / surface.MostRays();
    count = std::min(static_cast<size_t>(std::clamp<uint64_t>(affordable, 1, kBatch)),
                     candidates.size() - begin);
    std::vector<std::optional<OverlapSurface::Seen>> seen(count);
    parallel.For(count, [&](size_t k) {
      seen[k] = surface.Predict(views[candidates[begin + k]], scene, config, budget);
    });
    for (size_t k = 0; k < count; ++k) {
      if (!seen[k].has_value()) return check;
      check.rays += seen[k]->rays;
      ++check.checked;
      auto& list = seen[k]->verdict.registered() ? check.registrable : check.refused;
      if (&list == &check.registrable && list.size() >= wanted) continue;
      list.push_back({candidates[begin + k], seen[k]->verdict});
    }
  }
  check.finished = true;
  return check;
}

}  // namespace vantage
