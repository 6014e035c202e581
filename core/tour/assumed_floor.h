// Floor that nobody has seen, as far as known walls leave it (algorithm.md section 12, 'The
// order').
#ifndef VANTAGE_CORE_TOUR_ASSUMED_FLOOR_H_
#define VANTAGE_CORE_TOUR_ASSUMED_FLOOR_H_

#include <Eigen/Core>
#include <optional>

#include "core/fleet/travel.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::tour {

// z of the floor that a place is over, m; nothing where none is known or expected there.
std::optional<double> FloorBelow(const planning::PlanningProblem& problem,
                                 const Eigen::Vector3d& place);

// A floor at `height` (m, z) all over the site that is passable wherever the scanner fits between
// the surface that is known or expected, at the heights of a person who carries it. What is known
// to be passable is so, too.
fleet::WalkGrid AssumedFloor(const planning::PlanningProblem& problem, double height);

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_ASSUMED_FLOOR_H_
