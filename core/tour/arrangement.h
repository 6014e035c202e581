// Chosen stations made into a tour: ordered, and checked station by station (algorithm.md section
// 12, 'The order').
#ifndef VANTAGE_CORE_TOUR_ARRANGEMENT_H_
#define VANTAGE_CORE_TOUR_ARRANGEMENT_H_

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/registration/bound/verdict.h"
#include "core/tour/ordering.h"
#include "core/tour/tour.h"
#include "core/tour/tour_table.h"
#include "core/tour/ways.h"

namespace vantage::tour {

// A scan in its place and time.
struct ArrangedStop {
  uint32_t candidate = 0;
  size_t scanner = 0;
  std::optional<uint32_t> after;  // the candidate where the scanner stood before; absent: its start
  double wait = 0;                // minutes
  double start = 0;               // minutes of work
  double end = 0;
  int day = 0;
  registration::RegistrationVerdict verdict;
};

struct Arrangement {
  std::vector<ArrangedStop> stops;  // by end
  std::vector<double> done;         // minutes, by scanner
  double minutes = 0;
  // Of the first day, for the curve of what is worth going for.
  OrderProblem order;
  Routes routes;
  std::vector<uint32_t> stations;  // candidates, by station of `order`
  // Stations that no order makes register, and those whose rooms are closed whenever somebody could
  // be there.
  std::vector<uint32_t> not_registering;
  std::vector<uint32_t> closed;
  bool finished = true;  // false: the budget expired, and not every station was checked

  double area = 0;  // m^2, of the table's elements
};

// Orders stations, asks of every one what step F would say when its turn comes, and orders them
// anew where one would not register then, with what it relied on removed. References are kept.
class Arranger {
 public:
  // What the checks remove of the table's links and anchors stays away.
  Arranger(const planning::PlanningProblem& problem, const TourRequest& request,
           const TourTable& table, Ways& ways);

  // What is left of a cover problem after the checks so far.
  cover::CoverProblem Links() const;
  // The stations in an order. `steps`: of the search for it.
  Arrangement Arrange(std::span<const uint32_t> stations, size_t steps,
                      const parallel::Budget& budget, parallel::Parallel& parallel);
  // The order problem of some stations, for all scanners, of the first day.
  OrderProblem ProblemOf(std::span<const uint32_t> stations, const parallel::Budget& budget,
                         parallel::Parallel& parallel);
  std::optional<Eigen::Vector3d> StartOf(size_t scanner) const;
  uint64_t rays() const { return rays_; }

 private:
  bool Linked(uint32_t a, uint32_t b) const;
  bool Anchored(uint32_t candidate) const;
  OpenHours HoursOf(uint32_t candidate) const;
  void Schedule(std::span<const uint32_t> stations, size_t steps, const parallel::Budget& budget,
                parallel::Parallel& parallel, Arrangement& made);
  // Routes on one day, into `made`; returns the stations that the day is too short for.
  std::vector<uint32_t> AddDay(const OrderProblem& order, const Routes& routes,
                               std::span<const uint32_t> stations, int day, Arrangement& made);
  // False when some do not register, whose reliances are removed.
  bool Check(OverlapTable::Judging judging, const parallel::Budget& budget,
             parallel::Parallel& parallel, Arrangement& made);

  const planning::PlanningProblem& problem_;
  const TourRequest& request_;
  const TourTable& table_;
  Ways& ways_;
  // Links by which a station would not register, smaller first, and candidates that are not
  // anchored after all.
  absl::flat_hash_set<std::pair<uint32_t, uint32_t>> removed_links_;
  absl::flat_hash_set<uint32_t> not_anchored_;
  // Verdicts that were given: by candidate and, of all that it sees, what others had seen before.
  struct Given {
    registration::RegistrationVerdict verdict;
    bool whole = false;  // no look for rivals would change it
  };
  absl::flat_hash_map<std::pair<uint32_t, std::vector<uint64_t>>, Given> verdicts_;
  uint64_t rays_ = 0;
};

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_ARRANGEMENT_H_
