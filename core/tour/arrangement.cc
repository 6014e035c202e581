#include "core/tour/arrangement.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vantage::tour {
namespace {

constexpr int kOrders = 4;        // that are tried until every station registers
constexpr size_t kLessSteps = 4;  // of the search, where it begins with the order before
constexpr size_t kFewSteps = 50;  // the same, where stations are only taken out
constexpr double kMinute = 60;
constexpr int kMostDays = 60;

// By more than rounding.
bool EndsAfter(double end, double limit) { return end > limit + 1e-9; }

std::pair<uint32_t, uint32_t> Pair(uint32_t a, uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

Arranger::Arranger(const planning::PlanningProblem& problem, const TourRequest& request,
                   const TourTable& table, Ways& ways)
    : problem_(problem), request_(request), table_(table), ways_(ways) {}

bool Arranger::Linked(uint32_t a, uint32_t b) const {
  const std::vector<uint32_t>& links = table_.cover().links[a];
  return std::binary_search(links.begin(), links.end(), b) && !removed_links_.contains(Pair(a, b));
}

bool Arranger::Anchored(uint32_t candidate) const {
  const std::vector<uint32_t>& anchored = table_.cover().anchored;
  return std::binary_search(anchored.begin(), anchored.end(), candidate) &&
         !not_anchored_.contains(candidate);
}

cover::CoverProblem Arranger::Links() const {
  cover::CoverProblem left = table_.cover();
  for (const auto& [a, b] : removed_links_) {
    std::erase(left.links[a], b);
    std::erase(left.links[b], a);
  }
  for (const uint32_t candidate : not_anchored_) std::erase(left.anchored, candidate);
  return left;
}

OpenHours Arranger::HoursOf(uint32_t candidate) const {
  for (const RoomHours& hours : request_.hours) {
    if (hours.room.Contains(table_.candidates()[candidate].position)) return hours.open;
  }
  return {};
}

std::optional<Eigen::Vector3d> Arranger::StartOf(size_t scanner) const {
  if (request_.scanners[scanner].at.has_value()) return request_.scanners[scanner].at;
  if (problem_.model().stations().empty()) return std::nullopt;
  return problem_.model().stations().back().position;
}

OrderProblem Arranger::ProblemOf(std::span<const uint32_t> stations, const parallel::Budget& budget,
                                 parallel::Parallel& parallel) {
  OrderProblem order;
  order.rooted = table_.overlap().AnyKnown();
  std::vector<Eigen::Vector3d> places;
  for (const uint32_t station : stations) {
    places.push_back(table_.candidates()[station].position);
    order.storey.push_back(table_.candidates()[station].storey);
    order.anchored.push_back(Anchored(station) ? 1 : 0);
    order.links.emplace_back();
    for (uint32_t k = 0; k < stations.size(); ++k) {
      if (Linked(station, stations[k])) order.links.back().push_back(k);
    }
    if (!request_.hours.empty()) order.hours.push_back(HoursOf(station));
  }
  order.walk = ways_.Between(places, places, budget, parallel);
  bool any_reach = false;
  for (size_t s = 0; s < request_.scanners.size(); ++s) {
    const fleet::FleetMember& member = request_.scanners[s];
    order.speed.push_back(kMinute * member.speed);
    order.scan.push_back(member.scan_seconds / kMinute);
    if (const auto start = StartOf(s); start.has_value()) {
      order.first.push_back(ways_.Between({&*start, 1}, places, budget, parallel).front());
    } else {
      order.first.emplace_back(places.size(), 0);
    }
    any_reach = any_reach || !member.reach.empty();
  }
  for (size_t s = 0; s < request_.scanners.size() && any_reach; ++s) {
    const std::vector<planning::Region>& reach = request_.scanners[s].reach;
    order.may.emplace_back();
    for (const Eigen::Vector3d& place : places) {
      const bool may = reach.empty() || std::any_of(reach.begin(), reach.end(), [&](const auto& b) {
                         return b.contains(place);
                       });
      order.may.back().push_back(may ? 1 : 0);
    }
  }
  return order;
}

std::vector<uint32_t> Arranger::AddDay(const OrderProblem& order, const Routes& routes,
                                       std::span<const uint32_t> stations, int day,
                                       Arrangement& made) {
  const Timetable table = TimetableOf(order, routes);
  const double most = request_.day.value_or(kNoWay);
  const double begins = day == 0 ? 0 : day * most;
  std::vector<uint32_t> left;
  for (size_t s = 0; s < routes.size(); ++s) {
    std::optional<uint32_t> after;
    bool over = false;
    for (const uint32_t at : routes[s]) {
      over = over || EndsAfter(table.end[at], most);
      if (over) {
        left.push_back(stations[at]);
        continue;
      }
      ArrangedStop stop;
      stop.candidate = stations[at];
      stop.scanner = s;
      stop.after = after;
      stop.wait = table.wait[at];
      stop.start = begins + table.start[at];
      stop.end = begins + table.end[at];
      stop.day = day;
      made.done[s] = stop.end;
      made.minutes = std::max(made.minutes, stop.end);
      made.stops.push_back(stop);
      after = stations[at];
    }
  }
  return left;
}

void Arranger::Schedule(std::span<const uint32_t> stations, size_t steps,
                        const parallel::Budget& budget, parallel::Parallel& parallel,
                        Arrangement& made) {
  made.stops.clear();
  made.done.assign(request_.scanners.size(), 0);
  made.minutes = 0;
  std::vector<uint32_t> left(stations.begin(), stations.end());
  std::vector<uint8_t> seen(table_.overlap().elements(), 0);
  for (size_t i = 0; i < seen.size(); ++i) seen[i] = table_.overlap().Known(i) ? 1 : 0;
  for (int day = 0; !left.empty() && day < kMostDays; ++day) {
    OrderProblem order = ProblemOf(left, budget, parallel);
    if (day > 0) {
      // They all come in where overlap with what was seen is strongest.
      size_t strongest = 0;
      double most = -1;
      for (size_t k = 0; k < left.size(); ++k) {
        const OverlapTable::Sight& sight = table_.sight(left[k]);
        double share = 0;
        for (size_t i = 0; i < sight.elements.size(); ++i) {
          if (seen[sight.elements[i]] != 0) share += sight.share[i];
        }
        if (table_.overlap().MayRegister(sight, seen)) order.anchored[k] = 1;
        if (order.May(0, k) && share > most) {
          most = share;
          strongest = k;
        }
      }
      for (std::vector<double>& first : order.first) first = order.walk[strongest];
      order.first[0].assign(left.size(), kNoWay);
      order.first[0][strongest] = 0;
      const double begins = day * request_.day.value_or(0);
      for (OpenHours& hours : order.hours) {
        hours.from -= begins;
        hours.until -= begins;
      }
      order.anchored[strongest] = 1;
    }
    // What was removed changes little: the order before is where the search begins.
    const bool again = day == 0 && made.stations == left && !made.routes.empty();
    // All days together take a few times what one does.
    const size_t of_day = steps / static_cast<size_t>(day + 1);
    const Routes routes =
        OrderStations(order, again ? of_day / kLessSteps : of_day, problem_.config().seed, budget,
                      again ? std::optional(made.routes) : std::nullopt);
    if (day == 0) {
      made.order = order;
      made.routes = routes;
      made.stations = left;
    }
    const size_t before = made.stops.size();
    std::vector<uint32_t> next = AddDay(order, routes, left, day, made);
    for (size_t k = before; k < made.stops.size(); ++k) {
      for (const uint32_t i : table_.sight(made.stops[k].candidate).elements) seen[i] = 1;
    }
    if (made.stops.size() == before) break;  // not even one scan fits into a day
    left = std::move(next);
  }
  std::stable_sort(made.stops.begin(), made.stops.end(),
                   [](const ArrangedStop& a, const ArrangedStop& b) { return a.end < b.end; });
}

bool Arranger::Check(OverlapTable::Judging judging, const parallel::Budget& budget,
                     parallel::Parallel& parallel, Arrangement& made) {
  const bool whole = judging == OverlapTable::Judging::kWhole;
  std::vector<uint8_t> known(table_.overlap().elements(), 0);
  bool any_known = false;
  for (size_t i = 0; i < known.size(); ++i) {
    known[i] = table_.overlap().Known(i) ? 1 : 0;
    any_known = any_known || known[i] != 0;
  }
  struct Judged {
    std::optional<registration::RegistrationVerdict> verdict;
    uint64_t rays = 0;
    cover::ElementSet seen;  // of what the stop sees
    bool given = false;      // not for the first time
  };
  std::vector<Judged> judged(made.stops.size());
  parallel.For(made.stops.size(), [&](size_t k) {
    const ArrangedStop& stop = made.stops[k];
    std::vector<uint8_t> seen = known;
    bool any = any_known;
    for (const ArrangedStop& other : made.stops) {
      if (EndsAfter(other.end, stop.start) || &other == &stop) continue;
      for (const uint32_t i : table_.sight(other.candidate).elements) seen[i] = 1;
      any = true;
    }
    if (!any) {  // the first scan of all is where the world begins
      judged[k].verdict.emplace();
      judged[k].verdict->outcome = registration::RegistrationOutcome::kRegistered;
      return;
    }
    // Another order leaves most stops what they had.
    const std::vector<uint32_t>& sees = table_.sight(stop.candidate).elements;
    judged[k].seen = cover::EmptySet(sees.size());
    for (size_t i = 0; i < sees.size(); ++i) {
      if (seen[sees[i]] != 0) cover::Insert(judged[k].seen, i);
    }
    const auto given = verdicts_.find(std::pair(stop.candidate, judged[k].seen));
    if (given != verdicts_.end() && (given->second.whole || !whole)) {
      judged[k].verdict = given->second.verdict;
      judged[k].given = true;
      return;
    }
    judged[k].verdict = table_.overlap().Judge(table_.candidates()[stop.candidate], seen, judging,
                                               budget, judged[k].rays);
  });
  bool all = true;
  for (size_t k = 0; k < judged.size(); ++k) {
    ArrangedStop& stop = made.stops[k];
    rays_ += judged[k].rays;
    if (!judged[k].verdict.has_value()) {
      made.finished = false;
      continue;
    }
    stop.verdict = *std::move(judged[k].verdict);
    if (!judged[k].given && !judged[k].seen.empty()) {
      verdicts_.insert_or_assign(std::pair(stop.candidate, std::move(judged[k].seen)),
                                 Given{stop.verdict, whole || !stop.verdict.registered()});
    }
    if (stop.verdict.registered()) continue;
    all = false;
    if (Anchored(stop.candidate)) not_anchored_.insert(stop.candidate);
    for (const ArrangedStop& other : made.stops) {
      if (EndsAfter(other.end, stop.start) || &other == &stop) continue;
      if (Linked(stop.candidate, other.candidate)) {
        removed_links_.insert(Pair(stop.candidate, other.candidate));
      }
    }
  }
  return all;
}

Arrangement Arranger::Arrange(std::span<const uint32_t> stations, size_t steps,
                              const parallel::Budget& budget, parallel::Parallel& parallel) {
  Arrangement made;
  std::vector<uint32_t> left(stations.begin(), stations.end());
  bool settled = false;
  bool rivals_asked = false;
  for (int round = 0;; ++round) {
    // What is left out in the end needs no better order than there is.
    Schedule(left, settled ? steps / kFewSteps : steps, budget, parallel, made);
    if (budget.Expired()) {
      made.finished = false;
      break;
    }
    const size_t removed = removed_links_.size() + not_anchored_.size();
    // Rivals are looked for in an order that is possible without them.
    const bool without_rivals = Check(OverlapTable::Judging::kBeforeRivals, budget, parallel, made);
    const bool all = without_rivals && Check(OverlapTable::Judging::kWhole, budget, parallel, made);
    // An order by the same links would be the same order.
    const bool same_links = removed_links_.size() + not_anchored_.size() == removed;
    settled = settled || round + 1 >= kOrders || same_links;
    // When rivals have spoken for the first time, another order is tried, however many were before.
    if (without_rivals && !std::exchange(rivals_asked, true) && !same_links) settled = false;
    // Where a room is closed whenever a scanner could be in it, or nothing ties a station to the
    // rest, no order helps.
    std::vector<uint32_t> drop;
    for (const ArrangedStop& stop : made.stops) {
      if (!stop.verdict.registered() && made.finished && settled) {
        drop.push_back(stop.candidate);
        made.not_registering.push_back(stop.candidate);
      } else if (EndsAfter(stop.end, HoursOf(stop.candidate).until)) {
        drop.push_back(stop.candidate);
        made.closed.push_back(stop.candidate);
      }
    }
    if (left.size() > made.stops.size()) {  // not even a day is long enough
      std::vector<uint32_t> kept;
      for (const ArrangedStop& stop : made.stops) kept.push_back(stop.candidate);
      left = kept;
    }
    std::erase_if(left, [&](uint32_t station) {
      return std::find(drop.begin(), drop.end(), station) != drop.end();
    });
    if (drop.empty() && (all || !made.finished)) break;
    if (left.empty()) {
      made.stops.clear();
      made.done.assign(request_.scanners.size(), 0);
      made.minutes = 0;
      made.routes.clear();
      made.stations.clear();
      break;
    }
  }
  // What no day is long enough for is in no route.
  for (std::vector<uint32_t>& route : made.routes) {
    std::erase_if(route, [&](uint32_t at) {
      return std::none_of(made.stops.begin(), made.stops.end(), [&](const ArrangedStop& stop) {
        return stop.candidate == made.stations[at];
      });
    });
  }
  made.area = table_.Weight(left);
  return made;
}

}  // namespace vantage::tour
