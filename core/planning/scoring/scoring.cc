#include "core/planning/scoring/scoring.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/memory/memory.h"
#include "absl/status/status.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/visibility/target.h"

namespace vantage::planning {
namespace {

// How samples on a cell count (algorithm.md section 5, 'What a sample is worth').
struct SampleWorth {
  float from = 0;    // samples / m^2; samples beyond this density count
  float factor = 1;  // worth of a sample that counts
};

// True surface short of D has to be scanned again, however little it lacks; by the paper's metric
// it would be worth next to nothing. So true surface that comes to D gains its area times at least
// `min_deficit_share` of D, and only the samples beyond `min_counted_density_share` of D gain it.
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

// Under the open sky a ray meets something if something measured rises behind the cell, or if it
// goes down steeply enough to measure ground.
SkylineSines Expected(const DeficientCell& cell, const sensor::ScannerModel& scanner) {
  SkylineSines expected = cell.skyline;
  if (expected.covered()) return expected;
  const auto ground = static_cast<int8_t>(-std::floor(126 * std::cos(scanner.max_incidence)));
  for (int8_t& sine : expected.sine) sine = std::max(sine, ground);
  return expected;
}

// What the evaluation reads of a cell.
struct EvaluatedCell {
  Eigen::Vector3f position;  // m
  Eigen::Vector3f normal;
  float factor = 0;        // score per sample / m^2
  float from = 0;          // samples / m^2: what counts begins there
  float enough = 0;        // samples / m^2: and ends there
  Eigen::Vector3f target;  // of rays to it, scene coordinates
  std::span<const Eigen::Vector3f> dropouts;
  SkylineSines around;
};

// Cells as the evaluation reads them.
class EvaluatedCells {
 public:
  EvaluatedCells(const visibility::OpaqueGrid& grid, const PatchSet& patches,
                 const sensor::ScannerModel& scanner, const PlanningConfig& config)
      : grid_(grid),
        corner_(visibility::SceneCorner(grid)),
        patches_(patches),
        scanner_(scanner),
        config_(config) {}

  // Nothing where no view gains, or no ray reaches it.
  std::optional<EvaluatedCell> Of(uint32_t i) const {
    const DeficientCell cell = patches_.cells[i];
    const auto weight = static_cast<float>(config_.weights[static_cast<size_t>(cell.kind)]);
    // A scan is scored at the middle of a voxel and recorded at its worst corner. The expected
    // record is therefore the score's density divided by the spread of the scan before; otherwise
    // every place would promise again what it has given already.
    const SampleWorth worth = WorthOf(cell, config_);
    float factor = worth.factor * weight * cell.worth * cell.success * cell.area / cell.spread;
    float enough = cell.enough * cell.spread;
    if (!config_.density_on_false_surface && cell.kind != model::SurfaceKind::kTrue) {
      // A single sample on it gains the whole cell.
      factor *= enough;
      enough = 1;
    }
    if (!(factor > 0)) return std::nullopt;
    const auto target = visibility::TargetOf(grid_, cell.voxel, cell.normal);
    if (!target.has_value()) return std::nullopt;
    return EvaluatedCell{cell.position,
                         cell.normal,
                         factor,
                         worth.from * cell.spread,
                         enough,
                         (*target - corner_).cast<float>(),
                         std::span(patches_.dropouts).subspan(cell.dropouts, cell.dropout_count),
                         Expected(cell, scanner_)};
  }

 private:
  const visibility::OpaqueGrid& grid_;
  const Eigen::Vector3d corner_;
  const PatchSet& patches_;
  const sensor::ScannerModel& scanner_;
  const PlanningConfig& config_;
};

// The cells of all patches that views can gain on, found in parallel for a stretch of them at a
// time. False when cancelled on the way.
bool AddCells(const visibility::OpaqueGrid& grid, const PatchSet& patches,
              const sensor::ScannerModel& scanner, const PlanningConfig& config,
              parallel::Parallel& parallel, const parallel::Cancellation& cancelled,
              CellArrays& cells) {
  constexpr size_t kStretch = size_t{1} << 15;
  constexpr size_t kOfTask = size_t{1} << 11;
  const EvaluatedCells evaluated(grid, patches, scanner, config);
  const size_t size = patches.cells.size();
  cells.Reserve(size);
  std::vector<std::optional<EvaluatedCell>> found(std::min(kStretch, size));
  for (size_t begin = 0; begin < size; begin += kStretch) {
    if (cancelled.Requested()) return false;
    const size_t count = std::min(kStretch, size - begin);
    parallel.For((count + kOfTask - 1) / kOfTask, [&](size_t task) {
      const size_t end = std::min(count, (task + 1) * kOfTask);
      for (size_t i = task * kOfTask; i < end; ++i) {
        found[i] = evaluated.Of(static_cast<uint32_t>(begin + i));
      }
    });
    for (size_t i = 0; i < count; ++i) {
      if (!found[i].has_value()) continue;
      const EvaluatedCell& cell = *found[i];
      cells.Add(cell.position, cell.normal, cell.factor, cell.from, cell.enough, cell.target,
                static_cast<uint32_t>(begin + i), cell.dropouts, cell.around);
    }
  }
  return true;
}

}  // namespace

absl::StatusOr<OrderedCells> Scoring::CellsOf(const visibility::OpaqueGrid& grid,
                                              const PatchSet& patches,
                                              const sensor::ScannerModel& scanner,
                                              const PlanningConfig& config,
                                              parallel::Parallel& parallel,
                                              const parallel::Cancellation& cancelled) {
  CellArrays cells;
  if (!AddCells(grid, patches, scanner, config, parallel, cancelled, cells)) {
    return absl::CancelledError("patch cells");
  }
  return OrderedCells::Order(std::move(cells), parallel, cancelled);
}

absl::StatusOr<std::unique_ptr<const Scoring>> Scoring::Create(
    double voxel, const visibility::OpaqueGrid& grid, const visibility::OcclusionScene& scene,
    OrderedCells cells, const sensor::ScannerModel& scanner, const PlanningConfig& config,
    parallel::Parallel& parallel, const parallel::Cancellation& cancelled) {
  std::optional<visibility::OpaqueGrid> summed;
  if (config.pose_sensitivity) {
    auto made = grid.Summed(parallel, cancelled);
    if (!made.ok()) return made.status();
    summed = *std::move(made);
  }
  return absl::WrapUnique<const Scoring>(
      new Scoring(voxel, summed, scene, std::move(cells), scanner, config));
}

Scoring::Scoring(double voxel, const std::optional<visibility::OpaqueGrid>& summed,
                 const visibility::OcclusionScene& scene, OrderedCells cells,
                 const sensor::ScannerModel& scanner, const PlanningConfig& config)
    : constraints_(scanner),
      scene_(scene),
      cells_(std::move(cells)),
      // A view stands for its viewcell, grown by a person's positioning error.
      sensitivity_(summed.has_value() ? std::optional<PoseSensitivity>(
                                            std::in_place, constraints_, *summed,
                                            config.viewcell_size / 2 + scanner.positioning_error,
                                            voxel, scene.corner())
                                      : std::nullopt),
      scorer_(constraints_, scene, voxel, sensitivity_.has_value() ? &*sensitivity_ : nullptr) {}

}  // namespace vantage::planning
