// Puts a station of a tour first in a plan (algorithm.md section 12, 'Following a tour').
#ifndef VANTAGE_CORE_TOUR_FOLLOW_TOUR_H_
#define VANTAGE_CORE_TOUR_FOLLOW_TOUR_H_

#include <Eigen/Core>
#include <span>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/plan.h"
#include "core/planning/problem/planning_problem.h"

namespace vantage::tour {

// `stations`: of a tour, in their order (m, model frame). Of those where no scan was made yet,
// storey by storey as the tour has them, the one that brings most as things are becomes the plan's
// first view, if that is as much as a scan is worth (PlanningConfig::terminate_below) and a view
// registers there, else the next: of the views within kSamePlace of it the one that scores most.
// The other views keep their order. Sets Plan::followed_tour, also where none is
// acceptable, or the plan suggests to stop, and it stays as it is. `plan` is a plan of `problem`
// that has ended. Where no view was found otherwise, the plan's outcome becomes kViews. Where the
// budget ends before a view was found, eight stations more are looked at all the same, by one view
// each. Adds to the plan's rays.
void FollowTour(const planning::PlanningProblem& problem, std::span<const Eigen::Vector3d> stations,
                const parallel::Budget& budget, parallel::Parallel& parallel, planning::Plan& plan);

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_FOLLOW_TOUR_H_
