// The paper's order of evaluation: patch by patch, the most important first, each against the whole
// octree of views (algorithm.md section 8). It is a mode beside the anytime order;
// core/planning/README.md says which answers better when.
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
  // The run's cells are those of `patches`, which are ranked.
  PatchOrderScorer(EvaluationRun& run, const PatchSet& patches, const visibility::OpaqueGrid& grid,
                   const HierarchyOptions& options);

  // Evaluates the patches in their order until the budget is spent, then adds up the scores of the
  // views. Bounds are certain: patches not evaluated may be gained entirely or not at all. A work
  // limit is overrun by at most the rays of 16 groups of views on one patch.
  void Run(EvaluationProgress progress);

 private:
  // The evaluation of one patch.
  struct Group {
    OrderedCells cells;
    PatchTree tree;
  };
  // A group of views with the pairs of a patch that it evaluates.
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
  ShaftClassifier classifier_;
  ViewTree views_;
  std::vector<double> own_;    // by node of the view tree: samples that every view of it gains
  std::vector<double> alone_;  // by view and bin of the headings: further samples that it gains
  std::vector<Task> tasks_;
  std::vector<uint32_t> task_of_;  // by node, for the current patch
};

// Scores `views` on `cells` in that order.
Evaluation EvaluateByPatches(const BruteForceScorer& scorer, const FeasibleViews& views,
                             const CellArrays& cells, const PatchSet& patches,
                             const visibility::OpaqueGrid& grid, const HierarchyOptions& options,
                             const parallel::Budget& budget, parallel::Parallel& parallel,
                             EvaluationProgress progress);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_PATCH_ORDER_H_
