// The last phase of an evaluation scores every view exactly (algorithm.md section 8, 'Complete').
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_COMPLETION_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_COMPLETION_H_

#include <cstdint>

#include "core/planning/evaluation/evaluation_run.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// Scores view by view, the highest upper bound first, since this narrows the optimality gap
// fastest.
void CompleteByView(EvaluationRun& run, EvaluationProgress progress);

// Block by block through the hierarchy. What its upper levels leave to see bounds every view at
// once. `cells` are the run's.
void CompleteByHierarchy(EvaluationRun& run, const OrderedCells& cells,
                         const visibility::OpaqueGrid& grid, EvaluationProgress progress);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_COMPLETION_H_
