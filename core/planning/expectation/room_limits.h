// How far a room goes that was seen through its doorway (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_ROOM_LIMITS_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_ROOM_LIMITS_H_

#include <cstddef>

#include "core/model/view/planning_view.h"
#include "core/planning/plan/opening.h"

namespace vantage::planning {

// m from the middle of the doorway, in plan.
struct RoomLimits {
  double depth = 0;  // straight in
  double left = 0;   // to the left of who walks in
  double right = 0;
};

// `most`, less where a piece of wall was seen that faces the doorway, or the middle of the room
// from a side: a wall goes on straight, also where it was not seen. Of several the farthest counts,
// since what stands before a wall is furniture. A wall that was seen from its other side, out of
// the next room, ends the room, too, and of these the nearest.
RoomLimits LimitsBehind(const model::PlanningView& model, const Opening& opening,
                        const RoomLimits& most);

// `limits`, less where another doorway leads through the same wall into another room: a wall is
// expected half-way between the two.
RoomLimits EndedBetweenDoorways(const Openings& openings, size_t opening, const RoomLimits& limits);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_ROOM_LIMITS_H_
