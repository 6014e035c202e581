// What step D works on: patch cells with their targets, the scene that hides them, the scorer.
#ifndef VANTAGE_CORE_PLANNING_SCORING_H_
#define VANTAGE_CORE_PLANNING_SCORING_H_

#include "core/model/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/brute_force.h"
#include "core/planning/constraints.h"
#include "core/planning/occlusion_scene.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/patches.h"
#include "core/planning/plan.h"
#include "core/sensor/scanner_model.h"

namespace vantage {

class Scoring {
 public:
  // `grid` is the model's with axes {0, 1, 2}. Cells without a target or without weight are left
  // out: nothing can be gained there.
  Scoring(const PlanningView& model, const OpaqueGrid& grid, const PatchSet& patches,
          const ScannerModel& scanner, const PlanningConfig& config, Parallel& parallel);
  Scoring(const Scoring&) = delete;
  Scoring& operator=(const Scoring&) = delete;

  const CellArrays& cells() const { return cells_; }
  const OcclusionScene& scene() const { return scene_; }
  const BruteForceScorer& scorer() const { return scorer_; }

 private:
  SensingConstraints constraints_;
  OcclusionScene scene_;
  CellArrays cells_;
  BruteForceScorer scorer_;
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_SCORING_H_
