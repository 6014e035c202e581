// Places to stand that a tour chooses from: few of the feasible views, spread over all floors
// (algorithm.md section 12, 'Candidates').
#ifndef VANTAGE_CORE_TOUR_SPREAD_VIEWS_H_
#define VANTAGE_CORE_TOUR_SPREAD_VIEWS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/planning/problem/planning_problem.h"

namespace vantage::tour {

// A place to stand, and where the scanner faces there.
struct Candidate {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame
  std::optional<double> heading;  // rad; absent: a scanner that turns all around
  int storey = 0;

  bool operator==(const Candidate&) const = default;
};

// m between candidates: a sixth of the range at which surface that faces the scanner just comes to
// the required density, since a step of so much changes what comes to it by little; at least a
// viewcell, and at most a metre, since doorways and furniture decide what is seen from where.
double SpacingFor(const planning::PlanningProblem& problem);

// Feasible views of which no two that see each other are nearer than about `spacing` (m), and no
// feasible view is farther than that from all that it sees: on both sides of a wall there is one.
// In each column of viewcells the one nearest to the middle of the allowed heights counts. Where
// that would be more than `most`, they lie farther apart. `beside`, where given, are places near
// which all feasible views count that are `spacing` from each other, and no others. The same every
// time.
std::vector<Candidate> SpreadViews(const planning::PlanningProblem& problem, double spacing,
                                   size_t most, std::span<const Candidate> beside = {});

// The feasible view nearest to a place, on its storey; nothing where there is none within `within`
// (m).
std::optional<Candidate> NearestView(const planning::PlanningProblem& problem,
                                     const Eigen::Vector3d& place, double within);

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_SPREAD_VIEWS_H_
