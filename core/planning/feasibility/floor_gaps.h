// Floor that was not measured as such: at the foot of walls, and between measured floor
// (algorithm.md section 7A, 'The floor').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_GAPS_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_GAPS_H_

#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_columns.h"

namespace vantage::planning {

// What each returns is not in `floor` yet; nothing when cancelled on the way.

// Floor on which a scanner has stood, within the clearance that it had.
std::vector<PlacedFloor> FloorUnderStations(const model::PlanningView& model,
                                            const FloorColumns& floor);

// Columns beside a floor in which surface was measured within a step of the floor's height,
// whichever way it faces: where a wall or a riser meets the floor, normals are those of neither.
std::optional<std::vector<PlacedFloor>> FloorAtWalls(const model::PlanningView& model,
                                                     const FloorColumns& floor,
                                                     const parallel::Cancellation& cancelled);

// Gaps with floor at both ends of a straight line across, in which nothing shows that there is
// none.
std::optional<std::vector<PlacedFloor>> FloorBetween(const model::PlanningView& model,
                                                     const FloorColumns& floor,
                                                     const parallel::Cancellation& cancelled);

// What is expected where floor lies in a shadow: that it goes on between floor at both ends of a
// straight line of at most 2.5 m, where nothing shows that there is none. Good enough to walk over,
// for who sees it before, and nothing to send anybody to.
std::optional<std::vector<PlacedFloor>> FloorInShadows(const model::PlanningView& model,
                                                       const FloorColumns& floor,
                                                       const parallel::Cancellation& cancelled);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_GAPS_H_
