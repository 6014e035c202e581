// The fewest stations that cover enough, and the best of a given number (algorithm.md section 12).
#ifndef VANTAGE_CORE_COVER_CHOOSE_STATIONS_H_
#define VANTAGE_CORE_COVER_CHOOSE_STATIONS_H_

#include <cstddef>
#include <cstdint>
#include <span>

#include "absl/status/statusor.h"
#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"

namespace vantage::cover {

struct FewestStations {
  Cover cover;
  size_t least = 0;  // no choice that covers the goal has fewer; cover.stations.size() when proven
  // False: the goal is out of reach, and `cover` is all that can be had; or the budget was
  // cancelled before even the greedy choice covered it.
  bool complete = true;
};

// The fewest stations that cover `goal` (m^2, within 1e-9 of all weight): greedy first, then local
// search while the budget lasts. Greedy is had whatever time or work is left, since there
// has to be an answer, unless the budget is cancelled: then it is what was chosen by then. With a
// work limit the result is the same on any machine. A unit of work is one candidate looked
// at for one element, some nanoseconds. Out of reach: as few as are found that cover all that can
// be covered by stations that hang together. INVALID_ARGUMENT: the problem contradicts itself; the
// message names the field.
//
// `known`: stations that hang together, in any order. What they leave open is added greedily, and
// where that gives fewer stations than greed alone, the search begins with them.
absl::StatusOr<FewestStations> ChooseFewest(const CoverProblem& problem, double goal,
                                            const parallel::Budget& budget,
                                            std::span<const uint32_t> known = {});

// The `count` stations that cover most, or fewer where more would add nothing. Budget and errors as
// above.
absl::StatusOr<Cover> ChooseBest(const CoverProblem& problem, size_t count,
                                 const parallel::Budget& budget);

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_CHOOSE_STATIONS_H_
