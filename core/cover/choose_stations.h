// The fewest stations that cover enough, and the best of a given number (algorithm.md section 12).
#ifndef VANTAGE_CORE_COVER_CHOOSE_STATIONS_H_
#define VANTAGE_CORE_COVER_CHOOSE_STATIONS_H_

#include <cstddef>
#include <vector>

#include "absl/status/statusor.h"
#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"

namespace vantage::cover {

struct FewestStations {
  Cover cover;
  size_t least = 0;    // no choice that covers the goal has fewer; cover.stations.size() when proven
  bool complete = true;  // false: the goal is out of reach, and `cover` is all that can be had
};

// The fewest stations that cover `goal` (m^2): greedy first, then local search while the budget
// lasts; with a work limit the same on any machine. INVALID_ARGUMENT: the problem contradicts
// itself; the message names the field.
absl::StatusOr<FewestStations> ChooseFewest(const CoverProblem& problem, double goal,
                                            const parallel::Budget& budget);

// The `count` stations that cover most.
absl::StatusOr<Cover> ChooseBest(const CoverProblem& problem, size_t count,
                                 const parallel::Budget& budget);

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_CHOOSE_STATIONS_H_
