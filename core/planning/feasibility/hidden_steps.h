// Steps of stairs that lie under a tripod (algorithm.md section 7A, 'The floor').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_HIDDEN_STEPS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_HIDDEN_STEPS_H_

#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_columns.h"

namespace vantage::planning {

// What the blind cone of a scanner hides of stairs that go on beyond it, in one line down between
// the floors at its two ends; not in `floor` yet. A station at the head of stairs, or on them,
// covers one to three steps, which nobody else sees who has not walked them: everybody would be
// told that no way leads down. Nothing when cancelled on the way.
std::optional<std::vector<PlacedFloor>> HiddenSteps(const model::PlanningView& model,
                                                    const FloorColumns& floor,
                                                    const parallel::Cancellation& cancelled);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_HIDDEN_STEPS_H_
