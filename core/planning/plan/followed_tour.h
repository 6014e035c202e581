// What came of a wish that a plan follow a tour (algorithm.md section 12, 'Following a tour').
#ifndef VANTAGE_CORE_PLANNING_PLAN_FOLLOWED_TOUR_H_
#define VANTAGE_CORE_PLANNING_PLAN_FOLLOWED_TOUR_H_

#include <cstddef>
#include <optional>
#include <string>

namespace vantage::planning {

struct FollowedTour {
  // Index into the stations that were given of the one that the plan's first view is at. Absent:
  // the first view is the one that it would be without a tour.
  std::optional<size_t> station;
  // Index into Plan::views of the view that would be first without the tour. Absent where there is
  // none, or where there was room for one view only.
  std::optional<size_t> otherwise;
  std::string message;  // for people: all of it, or why the tour is not followed
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_FOLLOWED_TOUR_H_
