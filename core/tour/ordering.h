// In which order stations are gone to, and by whom (algorithm.md section 12, 'The order').
#ifndef VANTAGE_CORE_TOUR_ORDERING_H_
#define VANTAGE_CORE_TOUR_ORDERING_H_

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/parallel/budget.h"

namespace vantage::tour {

inline constexpr double kNoWay = std::numeric_limits<double>::infinity();

// Between which minutes after the beginning a scan may be under way; of a room with hours.
struct OpenHours {
  double from = 0;
  double until = kNoWay;
};

struct OrderProblem {
  // m of walking from station to station; kNoWay: there is no way. Not negative.
  std::vector<std::vector<double>> walk;
  // The same from where each scanner stands; 0 where that is not known.
  std::vector<std::vector<double>> first;
  std::vector<double> speed;  // m a minute, by scanner
  std::vector<double> scan;   // minutes to set up and scan, by scanner
  // By scanner and station, whether it may stand there; none: everybody may everywhere.
  std::vector<std::vector<uint8_t>> may;
  // By station, those that it could be aligned with. Symmetric.
  std::vector<std::vector<uint32_t>> links;
  // By station: it registers to what there was before. Where there was nothing, the first scan of
  // all needs nothing.
  std::vector<uint8_t> anchored;
  bool rooted = false;           // there was something, also where no station registers to it
  std::vector<int> storey;       // by station
  std::vector<OpenHours> hours;  // by station; none: all are open all the time

  size_t stations() const { return links.size(); }
  size_t scanners() const { return scan.size(); }
  bool May(size_t scanner, size_t station) const {
    return may.empty() || may[scanner][station] != 0;
  }
};

// By scanner, its stations in their order.
using Routes = std::vector<std::vector<uint32_t>>;

// When each station's scan is made.
struct Timetable {
  std::vector<double> walk;   // minutes, by station, from the one before
  std::vector<double> wait;   // minutes before the scan, for others' scans or for the door
  std::vector<double> start;  // minutes after the beginning, of setting up
  std::vector<double> end;
  std::vector<double> done;  // by scanner
  double minutes = 0;        // until the last scan is in
  // False where a scan would come before any that it can be aligned with, has no way, or a room is
  // closed.
  bool possible = true;
};

// Scans are made as soon as their scanner is there, one that they can be aligned with is in, and
// the room is open.
Timetable TimetableOf(const OrderProblem& problem, const Routes& routes);

// What routes cost, in minutes: until the last scan is in; a share of everybody's time, so that
// those who are done early are not sent astray; three minutes for every change of storey, so that
// storeys are done one after the other; and for several scanners up to a third of a scan
// for stations whose neighbours other scanners go to, so that each has a zone of its own. What is
// not possible costs for every such scan more than any wait for a room to open.
double CostOf(const OrderProblem& problem, const Routes& routes);

// Routes through all stations: the cheapest that were found. For one scanner and up to twelve
// stations that are open all the time it is the cheapest that there is (dynamic programming over
// sets: Held and Karp 1962); else the nearest that registers goes first, improved by simulated
// annealing over moves of one to three stations, exchanges and reversals, `steps` of them or until
// the budget expires. `from`, where given, are routes to begin with instead. With a work limit the
// same on any machine.
Routes OrderStations(const OrderProblem& problem, size_t steps, uint64_t seed,
                     const parallel::Budget& budget, const std::optional<Routes>& from = {});

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_ORDERING_H_
