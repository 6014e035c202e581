// The figures of a tour, as they are told (algorithm.md section 12).
#ifndef VANTAGE_CORE_TOUR_DESCRIBE_TOUR_H_
#define VANTAGE_CORE_TOUR_DESCRIBE_TOUR_H_

#include <cstdint>
#include <stop_token>

#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/tour/arrangement.h"
#include "core/tour/station_choice.h"
#include "core/tour/tour.h"
#include "core/tour/tour_table.h"
#include "core/tour/ways.h"

namespace vantage::tour {

// What a tour was made from. References are kept.
struct TourSources {
  const planning::PlanningProblem& problem;
  const TourRequest& request;
  const TourTable& table;
  const Arranger& arranger;
  const StationChoice& choice;
  const GainElements& checked;  // others than the table's, by which the tour is measured
  const Ways& ways;
};

// The tour of chosen stations, but for Tour::rays and Tour::complete. Of one that was cancelled on
// the way nobody reads the figures. Adds to `rays`.
Tour DescribeTour(const TourSources& from, const ChosenTour& chosen,
                  const std::stop_token& cancelled, parallel::Parallel& parallel, uint64_t& rays);

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_DESCRIBE_TOUR_H_
