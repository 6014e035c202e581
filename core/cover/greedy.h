// The greedy choice, and what it proves about all others.
#ifndef VANTAGE_CORE_COVER_GREEDY_H_
#define VANTAGE_CORE_COVER_GREEDY_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/cover/instance.h"
#include "core/cover/meter.h"

namespace vantage::cover {

struct Greedy {
  std::vector<Index> stations;  // each anchored or linked with one before it
  int64_t covered = 0;          // quanta
  // No choice that covers the goal has fewer stations. Whatever was chosen so far, any choice that
  // covers the goal adds what is missing to it, and each of its stations adds no more than what it
  // would add now; so it has at least as many as the largest of those sums need.
  size_t least = 0;
};

// Takes what adds most for each station each time: the candidate itself or, where it lies further
// off, with those on the way to it. Ends when `goal` (quanta) is covered, `most` stations are
// chosen, nothing adds anything, or the meter's budget is cancelled. Time and work do not end it,
// since an answer has to come of it: it takes a few hundredths of a second in the largest problems.
//
// `from`: stations that are chosen already.
Greedy ChooseGreedily(const Instance& instance, int64_t goal, size_t most, Meter& meter,
                      const std::vector<Index>& from = {});

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_GREEDY_H_
