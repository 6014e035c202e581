// Stairs that lead to a storey that nobody has entered (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_FLIGHTS_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_FLIGHTS_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_map.h"

namespace vantage::planning {

// Steps that leave a storey and end somewhere between it and the next.
struct Flight {
  Eigen::Vector3d end = Eigen::Vector3d::Zero();  // m, model frame: on the last step that is known
  double storey_floor = 0;                        // m, z: of the storey that it leaves
  double other_floor = 0;                         // m, z: where that is expected which it leads to

  bool up() const { return other_floor > storey_floor; }
};

// Floor farther than a sunken room from all storeys that are known, and joined by steps to one of
// them alone. Not those at whose end a scanner has stood, or on the storey that they lead to: what
// goes on from there it has seen. Storeys are as far apart as those that are known, or 2.8 m.
// Nothing when cancelled on the way.
std::optional<std::vector<Flight>> FindFlights(const model::PlanningView& model,
                                               const FloorMap& floor,
                                               const parallel::Cancellation& cancelled);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_FLIGHTS_H_
