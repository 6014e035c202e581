// What step D scores views with: patch cells with their targets, and the scorer (algorithm.md
// sections 5 and 8).
#ifndef VANTAGE_CORE_PLANNING_SCORING_SCORING_H_
#define VANTAGE_CORE_PLANNING_SCORING_SCORING_H_

#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/planning/scoring/pose_sensitivity.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// References are kept.
class Scoring {
 public:
  // `grid` and `scene` are the model's. Cells without a target or without weight are left out:
  // nothing can be gained there. CANCELLED when that was requested on the way.
  static absl::StatusOr<std::unique_ptr<const Scoring>> Create(
      double voxel, const visibility::OpaqueGrid& grid, const visibility::OcclusionScene& scene,
      const PatchSet& patches, const sensor::ScannerModel& scanner, const PlanningConfig& config,
      parallel::Parallel& parallel, const parallel::Cancellation& cancelled = {});
  Scoring(const Scoring&) = delete;
  Scoring& operator=(const Scoring&) = delete;

  const OrderedCells& cells() const { return cells_; }
  const visibility::OcclusionScene& scene() const { return scene_; }
  const BruteForceScorer& scorer() const { return scorer_; }

 private:
  // `summed`: where poses around a view count, too.
  Scoring(double voxel, const std::optional<visibility::OpaqueGrid>& summed,
          const visibility::OcclusionScene& scene, OrderedCells cells,
          const sensor::ScannerModel& scanner, const PlanningConfig& config);

  SensingConstraints constraints_;
  const visibility::OcclusionScene& scene_;
  OrderedCells cells_;
  // Where scores are those of every pose around a view.
  std::optional<PoseSensitivity> sensitivity_;
  BruteForceScorer scorer_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_SCORING_H_
