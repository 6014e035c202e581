// What step D works on: patch cells with their targets, the scene that hides them, the scorer.
#ifndef VANTAGE_CORE_PLANNING_SCORING_H_
#define VANTAGE_CORE_PLANNING_SCORING_H_

#include <optional>

#include "core/model/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/brute_force.h"
#include "core/planning/constraints.h"
#include "core/planning/occlusion_scene.h"
#include "core/planning/opaque_counts.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"
#include "core/planning/pose_sensitivity.h"
#include "core/sensor/scanner_model.h"

namespace vantage {

class Scoring {
 public:
  // `grid` is the model's with axes {0, 1, 2}. The cells are ordered for PatchTree: those of a
  // packet lie close together and face the same way, and so do those of a stratum of a sample.
  // Cells without a target or without weight are left out: nothing can be gained there. When the
  // budget expires on the way, only finished() may be asked.
  Scoring(const PlanningView& model, const OpaqueGrid& grid, const PatchSet& patches,
          const ScannerModel& scanner, const PlanningConfig& config, Parallel& parallel,
          const Budget& budget = Budget::Unlimited());
  Scoring(const Scoring&) = delete;
  Scoring& operator=(const Scoring&) = delete;

  bool finished() const { return finished_; }
  const CellArrays& cells() const { return cells_; }
  const OcclusionScene& scene() const { return scene_; }
  const BruteForceScorer& scorer() const { return scorer_; }

 private:
  const PoseSensitivity& Sensitivity(const OpaqueGrid& grid, const ScannerModel& scanner,
                                     const PlanningConfig& config, double voxel, Parallel& parallel,
                                     const Budget& budget);

  bool finished_ = false;
  SensingConstraints constraints_;
  OcclusionScene scene_;
  CellArrays cells_;  // in the order of PatchOrder()
  // Only for pose sensitivity.
  std::optional<OpaqueCounts> counts_;
  std::optional<PoseSensitivity> sensitivity_;
  BruteForceScorer scorer_;
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_SCORING_H_
