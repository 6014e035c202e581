// The paper's own order: patch by patch, the most important first, each against the whole octree of
// views (algorithm.md section 8). A mode: core/planning/README.md says when it answers well.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_PATCH_ORDER_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_PATCH_ORDER_H_

#include <cstdint>
#include <span>
#include <vector>

#include "core/planning/evaluation/evaluation_run.h"
#include "core/planning/evaluation/hierarchy.h"
#include "core/planning/evaluation/shaft_classifier.h"
#include "core/planning/evaluation/view_tree.h"
#include "core/planning/patches/patches.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// References are kept.
class PatchOrderScorer {
 public:
  // The run's cells are those of `patches`, which are ranked; `table` is the grid's.
  PatchOrderScorer(EvaluationRun& run, const PatchSet& patches, const visibility::OpaqueGrid& grid,
                   visibility::SummedVolumeTable table, const HierarchyOptions& options);

  // All patches in their order, until the budget is spent; then what was found is pushed down to
  // the views. Bounds are certain: what was not evaluated may all be gained, or nothing of it. A
  // work limit is overrun by what 16 groups of views cast for one patch, at most.
  void Run(EvaluationProgress progress);

 private:
  // Of one patch.
  struct Group {
    OrderedCells cells;
    PatchTree tree;
  };
  // Groups of views that a patch's pairs are handed to.
  struct Task {
    uint32_t node;
    std::vector<ViewBlock::Candidate> pairs;  // with nodes of the patch's tree
  };

  bool EvaluatePatch(const Group& group);
  void Assign(const Group& group, uint32_t node, ViewBlock::Candidate pair);
  uint64_t Evaluate(const Group& group, uint32_t node, ViewBlock::Candidate pair);
  void PushDown(double left);

  EvaluationRun& run_;
  const PatchSet& patches_;
  HierarchyOptions options_;
  visibility::SummedVolumeTable table_;
  ShaftClassifier classifier_;
  ViewTree views_;
  std::vector<double> own_;    // by node of the view tree, samples: every view of it gains this
  std::vector<double> alone_;  // by view: what it gains besides
  std::vector<Task> tasks_;
  std::vector<uint32_t> task_of_;  // by node, of the patch at hand
};

// Scores `views` on `cells` in that order.
Evaluation EvaluateByPatches(const BruteForceScorer& scorer, const FeasibleViews& views,
                             const CellArrays& cells, const PatchSet& patches,
                             const visibility::OpaqueGrid& grid, const HierarchyOptions& options,
                             const parallel::Budget& budget, parallel::Parallel& parallel,
                             EvaluationProgress progress);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_PATCH_ORDER_H_
