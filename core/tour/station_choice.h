// Which of a tour's candidates become its stations, and which of two tours is the better one
// (algorithm.md section 12).
#ifndef VANTAGE_CORE_TOUR_STATION_CHOICE_H_
#define VANTAGE_CORE_TOUR_STATION_CHOICE_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/tour/arrangement.h"
#include "core/tour/tour.h"
#include "core/tour/tour_table.h"

namespace vantage::tour {

// Stations that were chosen, in their order.
struct ChosenTour {
  Arrangement arrangement;
  bool reaches_goal = false;
  double lost = 0;  // m^2, by stations that were left out since they would not register
  // Stations that scans or minutes would be enough for, and that were left out since they bring too
  // little.
  size_t not_worth_it = 0;
};

// What a choice may take.
struct ChoiceEffort {
  parallel::Budget choosing;   // of stations, as core/cover counts work
  parallel::Budget arranging;  // of their order
  parallel::Budget whole;      // of the round: of several tries no further one begins beyond it
  size_t steps = 0;            // of the search for an order
};

// Keeps the references; the table may grow.
class StationChoice {
 public:
  StationChoice(const planning::PlanningProblem& problem, const TourRequest& request,
                const TourTable& table, Arranger& arranger, parallel::Parallel& parallel)
      : problem_(problem),
        request_(request),
        table_(table),
        arranger_(arranger),
        parallel_(parallel) {}

  // The table's first candidates are the stations of the earlier tour.
  void SetPrevious(size_t count) { previous_ = count; }
  bool IsPrevious(uint32_t candidate) const { return candidate < previous_; }

  // From the table as it is now. `known`: candidates that the search begins with. Nothing when the
  // budgets ended on the way.
  std::optional<ChosenTour> Choose(const ChoiceEffort& effort, const std::vector<uint32_t>& known);

  // Whether `a` is what is asked for rather than `b`, both from the table as it is now.
  bool Better(const ChosenTour& a, const ChosenTour& b) const;

  // m^2 at the required density before the first scan.
  double AreaBefore() const { return problem_.coverage().area_at_density; }
  // m^2 of the table's elements that have to be brought to it.
  double GoalWeight() const;
  // m^2 by which a plan judges whether a scan is worth it.
  double WorthAScan() const { return problem_.config().terminate_below; }
  // No choice of the table's candidates that reaches the goal has fewer stations; 0: not known.
  size_t Fewest() const { return fewest_of_ == table_.candidates().size() ? fewest_ : 0; }

 private:
  ChosenTour NoStations(bool reaches_goal) const;
  std::optional<ChosenTour> ChooseForGoal(const cover::CoverProblem& cover,
                                          const ChoiceEffort& effort,
                                          const std::vector<uint32_t>& known);
  std::optional<ChosenTour> ChooseWithinLimits(const cover::CoverProblem& cover,
                                               const ChoiceEffort& effort);
  size_t MostStations() const;
  std::optional<ChosenTour> Arranged(const cover::CoverProblem& cover,
                                     std::vector<uint32_t> stations, double goal,
                                     const ChoiceEffort& effort);
  std::optional<std::vector<uint32_t>> WithPrevious(const cover::CoverProblem& cover, double goal,
                                                    size_t most, const ChoiceEffort& effort) const;
  double Value(const ChosenTour& chosen) const;

  const planning::PlanningProblem& problem_;
  const TourRequest& request_;
  const TourTable& table_;
  Arranger& arranger_;
  parallel::Parallel& parallel_;
  size_t previous_ = 0;
  size_t fewest_ = 0;
  size_t fewest_of_ = 0;  // candidates
};

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_STATION_CHOICE_H_
