// What step D works on: patch cells with their targets, the scene that hides them, the scorer.
#ifndef VANTAGE_CORE_PLANNING_SCORING_SCORING_H_
#define VANTAGE_CORE_PLANNING_SCORING_SCORING_H_

#include <optional>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/pose_sensitivity.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"
#include "core/visibility/summed_volume_table.h"

namespace vantage::planning {

class Scoring {
 public:
  // `grid` is the model's with axes {0, 1, 2}. The cells are ordered for PatchTree: those of a
  // packet lie close together and face the same way, and so do those of a stratum of a sample.
  // Cells without a target or without weight are left out: nothing can be gained there. When the
  // budget expires on the way, only finished() may be asked.
  Scoring(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
          const PatchSet& patches, const sensor::ScannerModel& scanner,
          const PlanningConfig& config, parallel::Parallel& parallel,
          const parallel::Budget& budget = parallel::Budget::Unlimited());
  Scoring(const Scoring&) = delete;
  Scoring& operator=(const Scoring&) = delete;

  bool finished() const { return finished_; }
  const CellArrays& cells() const { return cells_; }
  const visibility::OcclusionScene& scene() const { return scene_; }
  const BruteForceScorer& scorer() const { return scorer_; }

 private:
  const PoseSensitivity& Sensitivity(const visibility::OpaqueGrid& grid,
                                     const sensor::ScannerModel& scanner,
                                     const PlanningConfig& config, double voxel,
                                     parallel::Parallel& parallel, const parallel::Budget& budget);

  bool finished_ = false;
  SensingConstraints constraints_;
  visibility::OcclusionScene scene_;
  CellArrays cells_;  // in the order of PatchOrder()
  // Only for pose sensitivity.
  std::optional<visibility::SummedVolumeTable> table_;
  std::optional<PoseSensitivity> sensitivity_;
  BruteForceScorer scorer_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_SCORING_H_
