// Which of chosen stations are worth their scans, without letting the others fall apart
// (algorithm.md section 12, 'What is left').
#ifndef VANTAGE_CORE_TOUR_WORTHWHILE_STATIONS_H_
#define VANTAGE_CORE_TOUR_WORTHWHILE_STATIONS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"

namespace vantage::tour {

// m^2 that each of the stations alone covers.
std::vector<double> OwnAreas(const cover::CoverProblem& cover,
                             const std::vector<uint32_t>& stations);

// Takes out stations that bring less than `worth` (m^2) beyond the others, the least first, if the
// others hang together without them and cover `goal` (m^2). Returns how many.
size_t LeaveOutWhatIsNotWorthIt(const cover::CoverProblem& cover, double worth, double goal,
                                const parallel::Budget& budget, std::vector<uint32_t>& stations);

// Those of the stations that hang together with what is there already; where nothing is, the part
// that covers most. In their order.
std::vector<uint32_t> PartThatHangsTogether(const cover::CoverProblem& cover,
                                            const std::vector<uint32_t>& stations);

// Of the stations of an earlier tour those that are gone to again: they hang together, and each
// brings `worth` beyond the others or holds others.
std::vector<uint32_t> StationsToKeep(const cover::CoverProblem& cover,
                                     const std::vector<uint32_t>& stations, double worth,
                                     const parallel::Budget& budget);

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_WORTHWHILE_STATIONS_H_
