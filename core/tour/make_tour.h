// Makes a tour: which stations bring everything to the required density, in which order they are
// gone to and by whom, and how long that takes (algorithm.md section 12).
#ifndef VANTAGE_CORE_TOUR_MAKE_TOUR_H_
#define VANTAGE_CORE_TOUR_MAKE_TOUR_H_

#include <cstdint>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/tour/tour.h"

namespace vantage::tour {

// Called with every tour that is better than the one before, on the thread that makes it.
using TourProgress = absl::FunctionRef<void(const Tour&)>;

// From a model with what is expected of it, whatever that comes from; before the first scan, too,
// where all is expected. A first tour comes soon, from few candidates; then from more, and from
// more beside the stations that were chosen, until nothing improves or the budget ends; what was
// chosen by then is still arranged, which takes some seconds on a large site. With a work
// limit and no deadline the same on any number of threads. INVALID_ARGUMENT: the request is
// impossible; the message names the field. FAILED_PRECONDITION: there is nowhere to stand.
// CANCELLED: it was, or the budget ended before there was a tour.
absl::StatusOr<Tour> MakeTour(const planning::PlanningProblem& problem, const TourRequest& request,
                              const parallel::Budget& budget, parallel::Parallel& parallel,
                              TourProgress progress);

// Upper bound of what a tour takes besides its problem, bytes.
uint64_t EstimateTourMemory(const TourRequest& request);

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_MAKE_TOUR_H_
