// The storey that a flight of stairs leads to, as it is expected (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_STOREY_BEYOND_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_STOREY_BEYOND_H_

#include "core/model/view/planning_view.h"
#include "core/planning/expectation/brick_edit.h"
#include "core/planning/expectation/flights.h"
#include "core/planning/feasibility/floor_map.h"

namespace vantage::planning {

// Adds a hall as wide as the one that the flight leaves is known to be near the flight, since walls
// mostly stand on walls: floor, free space, walls and a ceiling, where nothing is known; and free
// space between the two where the one that is known opens to the stairs. No floor to stand on.
void ExpectStorey(const model::PlanningView& model, const FloorMap& floor, const Flight& flight,
                  BrickEdit& edit);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_STOREY_BEYOND_H_
