#include "core/tour/ordering.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

namespace vantage::tour {
namespace {

constexpr size_t kExactly = 12;             // stations that are ordered by going through all sets
constexpr double kOfEverybodysTime = 0.05;  // what a minute of somebody costs who is not the last
constexpr double kChangeOfStorey = 3;       // minutes
// Of a scan's minutes, of a station whose neighbours all are somebody else's: a price of its own
// would leave scanners without work where scans are short and few are left.
constexpr double kBorder = 1.0 / 3;
constexpr size_t kNeighbours = 5;
// Minutes, of a scan that is not possible; with rooms that open later, more than any wait: a job of
// a thousand stations may take so many.
constexpr double kImpossible = 1000;
constexpr size_t kStepsBetweenPolls = 256;
// The annealing's temperature at its beginning and at its end, minutes, above 0: a change that
// costs so much more is accepted once in e times. At first that is a change of storey or a walk
// across a large hall and back; in the end a second, less than any plan is kept to.
constexpr double kHottest = 4;
constexpr double kColdest = 0.02;
constexpr size_t kLongestMove = 3;  // stations

// The same on every machine, as the standard's distributions are not.
class Draws {
 public:
  explicit Draws(uint64_t seed) : bits_(seed) {}
  size_t Below(size_t count) { return static_cast<size_t>(bits_() % count); }
  double Uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }

 private:
  std::mt19937_64 bits_;
};

bool AnyAnchored(const OrderProblem& problem) {
  return problem.rooted || std::any_of(problem.anchored.begin(), problem.anchored.end(),
                                       [](uint8_t anchored) { return anchored != 0; });
}

double CostOfTheImpossible(const OrderProblem& problem) {
  double latest = 0;
  for (const OpenHours& hours : problem.hours) {
    if (std::isfinite(hours.from)) latest = std::max(latest, hours.from);
  }
  return kImpossible + 2 * latest;
}

// Each station's nearest, by walking.
std::vector<std::vector<uint32_t>> NeighboursOf(const OrderProblem& problem, size_t count) {
  std::vector<std::vector<uint32_t>> nearest(problem.stations());
  for (uint32_t i = 0; i < nearest.size(); ++i) {
    for (uint32_t j = 0; j < nearest.size(); ++j) {
      if (j != i && std::isfinite(problem.walk[i][j])) nearest[i].push_back(j);
    }
    std::stable_sort(nearest[i].begin(), nearest[i].end(), [&](uint32_t a, uint32_t b) {
      return problem.walk[i][a] < problem.walk[i][b];
    });
    if (nearest[i].size() > count) nearest[i].resize(count);
  }
  return nearest;
}

// Runs routes through time.
class Clockwork {
 public:
  explicit Clockwork(const OrderProblem& problem)
      : problem_(problem),
        any_anchored_(AnyAnchored(problem)),
        impossible_(CostOfTheImpossible(problem)),
        border_(kBorder * std::accumulate(problem.scan.begin(), problem.scan.end(), 0.0) /
                static_cast<double>(problem.scanners())),
        // Who is alone has no borders.
        neighbours_(problem.scanners() > 1 ? NeighboursOf(problem, kNeighbours)
                                           : std::vector<std::vector<uint32_t>>()),
        opens_(problem.stations()),
        of_(problem.stations()),
        open_from_(problem.stations()) {
    for (uint32_t i = 0; i < opens_.size(); ++i) {
      for (const uint32_t other : problem.links[i]) {
        if (problem.anchored[other] == 0) opens_[i].push_back(other);
      }
    }
  }

  // `table`, where given, is filled. Returns the cost.
  double Run(const Routes& routes, Timetable* table) {
    const size_t scanners = problem_.scanners();
    for (size_t i = 0; i < open_from_.size(); ++i) {
      open_from_[i] = problem_.anchored[i] != 0 ? 0 : kNoWay;
    }
    next_.assign(scanners, 0);
    free_.assign(scanners, 0);
    bool begun = any_anchored_;
    size_t impossible = 0;
    double changes = 0;
    for (;;) {
      // The scan that can begin first. Those that cannot yet wait for it.
      size_t who = scanners;
      double start = kNoWay;
      double arrival = 0;
      bool any = false;
      for (size_t s = 0; s < scanners; ++s) {
        if (next_[s] == routes[s].size()) continue;
        const uint32_t at = routes[s][next_[s]];
        const double there = free_[s] + WalkTo(routes, s);
        const double ready = begun ? std::max(there, open_from_[at]) : there;
        const double opens = problem_.hours.empty() ? 0 : problem_.hours[at].from;
        if (!any || std::max(ready, opens) < start) {
          who = s;
          start = std::max(ready, opens);
          arrival = there;
        }
        any = true;
      }
      if (!any) break;
      const uint32_t at = routes[who][next_[who]];
      if (!std::isfinite(start)) {
        // Nothing that it could be aligned with comes before it, or there is no way.
        ++impossible;
        arrival = start = free_[who];
      }
      const double end = start + problem_.scan[who];
      if (!problem_.hours.empty() && end > problem_.hours[at].until) ++impossible;
      if (next_[who] > 0 && problem_.storey[routes[who][next_[who] - 1]] != problem_.storey[at]) {
        ++changes;
      }
      if (table != nullptr) {
        table->walk[at] = arrival - free_[who];
        table->wait[at] = start - arrival;
        table->start[at] = start;
        table->end[at] = end;
      }
      begun = true;
      open_from_[at] = std::min(open_from_[at], end);
      for (const uint32_t other : opens_[at]) {
        open_from_[other] = std::min(open_from_[other], end);
      }
      free_[who] = end;
      ++next_[who];
    }
    double last = 0;
    double sum = 0;
    for (size_t s = 0; s < scanners; ++s) {
      const double done = routes[s].empty() ? 0 : free_[s];
      last = std::max(last, done);
      sum += done;
    }
    if (table != nullptr) {
      table->done = free_;
      table->minutes = last;
      table->possible = impossible == 0;
    }
    return last + kOfEverybodysTime * (sum - last) + kChangeOfStorey * changes +
           border_ * Borders(routes) + impossible_ * static_cast<double>(impossible);
  }

 private:
  double WalkTo(const Routes& routes, size_t s) const {
    const uint32_t at = routes[s][next_[s]];
    if (!problem_.May(s, at)) return kNoWay;
    const double way =
        next_[s] == 0 ? problem_.first[s][at] : problem_.walk[routes[s][next_[s] - 1]][at];
    return way / problem_.speed[s];
  }
  double Borders(const Routes& routes) {
    if (routes.size() < 2) return 0;
    for (size_t s = 0; s < routes.size(); ++s) {
      for (const uint32_t at : routes[s]) of_[at] = s;
    }
    double borders = 0;
    for (uint32_t i = 0; i < neighbours_.size(); ++i) {
      if (neighbours_[i].empty()) continue;
      size_t others = 0;
      for (const uint32_t j : neighbours_[i]) others += of_[j] != of_[i];
      borders += static_cast<double>(others) / static_cast<double>(neighbours_[i].size());
    }
    return borders;
  }

  const OrderProblem& problem_;
  const bool any_anchored_;
  const double impossible_;  // minutes
  const double border_;      // minutes
  const std::vector<std::vector<uint32_t>> neighbours_;
  // By station, those that its scan lets register which do not do so from the beginning.
  std::vector<std::vector<uint32_t>> opens_;
  std::vector<size_t> of_;
  std::vector<double> open_from_;  // minutes, by station: from when on it registers
  std::vector<size_t> next_;
  std::vector<double> free_;
};

// The cheapest route of one scanner through a few stations.
Routes Exactly(const OrderProblem& problem) {
  const size_t n = problem.stations();
  const bool any_anchored = AnyAnchored(problem);
  const auto change = [&](size_t a, size_t b) {
    return problem.storey[a] == problem.storey[b] ? 0 : kChangeOfStorey;
  };
  const size_t sets = size_t{1} << n;
  std::vector<size_t> linked(n, 0);  // by station, the set of those that it registers to
  for (size_t i = 0; i < n; ++i) {
    for (const uint32_t j : problem.links[i]) linked[i] |= size_t{1} << j;
  }
  std::vector<double> cost(sets * n, kNoWay);
  std::vector<uint8_t> before(sets * n, 0);
  for (size_t i = 0; i < n; ++i) {
    if (!any_anchored || problem.anchored[i] != 0) {
      cost[(size_t{1} << i) * n + i] = problem.first[0][i] / problem.speed[0];
    }
  }
  for (size_t set = 1; set < sets; ++set) {
    for (size_t at = 0; at < n; ++at) {
      const double so_far = cost[set * n + at];
      if (!std::isfinite(so_far)) continue;
      for (size_t to = 0; to < n; ++to) {
        if ((set >> to & 1) != 0) continue;
        if (problem.anchored[to] == 0 && (linked[to] & set) == 0) continue;
        const double reached = so_far + problem.walk[at][to] / problem.speed[0] + change(at, to);
        double& best = cost[(set | size_t{1} << to) * n + to];
        if (reached >= best) continue;
        best = reached;
        before[(set | size_t{1} << to) * n + to] = static_cast<uint8_t>(at);
      }
    }
  }
  size_t set = sets - 1;
  size_t at = 0;
  for (size_t i = 1; i < n; ++i) {
    if (cost[set * n + i] < cost[set * n + at]) at = i;
  }
  if (!std::isfinite(cost[set * n + at])) return {};
  std::vector<uint32_t> route;
  while (set != 0) {
    route.push_back(static_cast<uint32_t>(at));
    const size_t earlier = before[set * n + at];
    set &= ~(size_t{1} << at);
    at = earlier;
  }
  std::reverse(route.begin(), route.end());
  return {route};
}

// The scanner that is free first goes where it can begin first, nearest first, among the stations
// that register by then.
Routes NearestFirst(const OrderProblem& problem) {
  const size_t n = problem.stations();
  Routes routes(problem.scanners());
  std::vector<double> free(problem.scanners(), 0);
  std::vector<double> open_from(n);
  for (size_t i = 0; i < n; ++i) open_from[i] = problem.anchored[i] != 0 ? 0 : kNoWay;
  bool begun = AnyAnchored(problem);
  std::vector<uint8_t> taken(n, 0);
  for (size_t k = 0; k < n; ++k) {
    size_t who = 0;
    size_t where = n;
    double best = kNoWay;
    for (size_t s = 0; s < routes.size(); ++s) {
      for (size_t i = 0; i < n; ++i) {
        if (taken[i] != 0 || !problem.May(s, i)) continue;
        const double way =
            routes[s].empty() ? problem.first[s][i] : problem.walk[routes[s].back()][i];
        double start = free[s] + way / problem.speed[s];
        if (begun) start = std::max(start, open_from[i]);
        if (!problem.hours.empty()) start = std::max(start, problem.hours[i].from);
        if (!routes[s].empty() && problem.storey[routes[s].back()] != problem.storey[i]) {
          start += kChangeOfStorey;
        }
        if (start < best) {
          best = start;
          who = s;
          where = i;
        }
      }
    }
    if (where == n) {  // the rest registers to nothing: it comes last, and costs
      for (uint32_t i = 0; i < n; ++i) {
        if (taken[i] == 0) routes[0].push_back(i);
      }
      break;
    }
    begun = true;
    taken[where] = 1;
    routes[who].push_back(static_cast<uint32_t>(where));
    free[who] = best + problem.scan[who];
    open_from[where] = std::min(open_from[where], free[who]);
    for (const uint32_t other : problem.links[where]) {
      open_from[other] = std::min(open_from[other], free[who]);
    }
  }
  return routes;
}

class Annealing {
 public:
  Annealing(const OrderProblem& problem, uint64_t seed)
      : problem_(problem),
        clockwork_(problem),
        near_(NeighboursOf(problem, 2 * kNeighbours)),
        draws_(seed) {}

  Routes Improve(Routes routes, size_t steps, const parallel::Budget& budget) {
    double cost = clockwork_.Run(routes, nullptr);
    Routes best = routes;
    double least = cost;
    for (size_t step = 0; step < steps; ++step) {
      if (step % kStepsBetweenPolls == 0 && budget.Expired()) break;
      const double share = static_cast<double>(step) / static_cast<double>(steps);
      const double heat = kHottest * std::pow(kColdest / kHottest, share);
      Routes changed = routes;
      if (!Change(changed)) continue;
      const double now = clockwork_.Run(changed, nullptr);
      if (now > cost && draws_.Uniform() >= std::exp((cost - now) / heat)) continue;
      routes = std::move(changed);
      cost = now;
      if (cost < least) {
        least = cost;
        best = routes;
      }
    }
    return best;
  }

 private:
  struct At {
    size_t route = 0;
    size_t place = 0;
  };
  At Find(const Routes& routes, uint32_t station) const {
    for (size_t s = 0; s < routes.size(); ++s) {
      const auto it = std::find(routes[s].begin(), routes[s].end(), station);
      if (it != routes[s].end()) return {s, static_cast<size_t>(it - routes[s].begin())};
    }
    return {};
  }

  // False where the draw changes nothing.
  bool Change(Routes& routes) {
    const size_t n = problem_.stations();
    const auto station = static_cast<uint32_t>(draws_.Below(n));
    const At from = Find(routes, station);
    switch (draws_.Below(5)) {
      case 0:
        return Reverse(routes[from.route], from.place);
      case 1:
        return Exchange(routes, from);
      case 2:
        return ExchangeTails(routes, from);
      default:
        return Move(routes, station, from);
    }
  }

  // One to three stations go beside a neighbour of theirs, or to the beginning of a route.
  bool Move(Routes& routes, uint32_t station, const At& from) {
    std::vector<uint32_t>& source = routes[from.route];
    const size_t most = std::min(kLongestMove, source.size() - from.place);
    const size_t count = 1 + draws_.Below(most);
    const auto begin = source.begin() + static_cast<ptrdiff_t>(from.place);
    std::vector<uint32_t> moved(begin, begin + static_cast<ptrdiff_t>(count));
    source.erase(begin, begin + static_cast<ptrdiff_t>(count));
    if (draws_.Below(2) == 0) std::reverse(moved.begin(), moved.end());
    At to;
    if (near_[station].empty() || draws_.Below(8) == 0) {
      to.route = draws_.Below(routes.size());
    } else {
      const uint32_t beside = near_[station][draws_.Below(near_[station].size())];
      if (std::find(moved.begin(), moved.end(), beside) != moved.end()) {
        to.route = from.route;
        to.place = draws_.Below(source.size() + 1);
      } else {
        to = Find(routes, beside);
        to.place += draws_.Below(2);
      }
    }
    routes[to.route].insert(routes[to.route].begin() + static_cast<ptrdiff_t>(to.place),
                            moved.begin(), moved.end());
    return true;
  }
  bool Reverse(std::vector<uint32_t>& route, size_t place) {
    const size_t other = draws_.Below(route.size());
    if (other == place) return false;
    std::reverse(route.begin() + static_cast<ptrdiff_t>(std::min(place, other)),
                 route.begin() + static_cast<ptrdiff_t>(std::max(place, other) + 1));
    return true;
  }
  bool Exchange(Routes& routes, const At& from) {
    const At other = Find(routes, static_cast<uint32_t>(draws_.Below(problem_.stations())));
    if (other.route == from.route && other.place == from.place) return false;
    std::swap(routes[from.route][from.place], routes[other.route][other.place]);
    return true;
  }
  // What two scanners do from some station on.
  bool ExchangeTails(Routes& routes, const At& from) {
    if (routes.size() < 2) return false;
    const size_t other = draws_.Below(routes.size());
    if (other == from.route) return false;
    std::vector<uint32_t>& a = routes[from.route];
    std::vector<uint32_t>& b = routes[other];
    const auto cut = a.begin() + static_cast<ptrdiff_t>(from.place);
    const auto cut_b = b.begin() + static_cast<ptrdiff_t>(draws_.Below(b.size() + 1));
    std::vector<uint32_t> tail(cut, a.end());
    std::vector<uint32_t> tail_b(cut_b, b.end());
    a.erase(cut, a.end());
    b.erase(cut_b, b.end());
    a.insert(a.end(), tail_b.begin(), tail_b.end());
    b.insert(b.end(), tail.begin(), tail.end());
    return true;
  }

  const OrderProblem& problem_;
  Clockwork clockwork_;
  const std::vector<std::vector<uint32_t>> near_;
  Draws draws_;
};

}  // namespace

Timetable TimetableOf(const OrderProblem& problem, const Routes& routes) {
  Timetable table;
  for (std::vector<double>* column : {&table.walk, &table.wait, &table.start, &table.end}) {
    column->assign(problem.stations(), 0);
  }
  Clockwork(problem).Run(routes, &table);
  return table;
}

double CostOf(const OrderProblem& problem, const Routes& routes) {
  return Clockwork(problem).Run(routes, nullptr);
}

Routes OrderStations(const OrderProblem& problem, size_t steps, uint64_t seed,
                     const parallel::Budget& budget, const std::optional<Routes>& from) {
  if (problem.stations() == 0) return Routes(problem.scanners());
  if (problem.scanners() == 1 && problem.hours.empty() && problem.may.empty() &&
      problem.stations() <= kExactly) {
    Routes best = Exactly(problem);
    if (!best.empty()) return best;
  }
  Routes routes = NearestFirst(problem);
  if (from.has_value() && CostOf(problem, *from) <= CostOf(problem, routes)) routes = *from;
  return Annealing(problem, seed).Improve(std::move(routes), steps, budget);
}

}  // namespace vantage::tour
