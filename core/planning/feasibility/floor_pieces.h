// Which measured surface is floor (algorithm.md section 7A, 'The floor').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_PIECES_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_PIECES_H_

#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_columns.h"

namespace vantage::planning {

// The largest step between neighbouring pieces of one floor, m: what a building code allows a
// stair.
inline constexpr double kMaxStep = 0.20;
// Tangent of 35 degrees, of the stairs that people carry things up.
inline constexpr double kSteepestStairs = 0.7;

// The measured floor in columns that span the model's bounds. Nothing when cancelled on the way.
std::optional<std::vector<PlacedFloor>> MeasuredFloor(const model::PlanningView& model,
                                                      const FloorColumns& columns,
                                                      const parallel::Cancellation& cancelled);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_PIECES_H_
