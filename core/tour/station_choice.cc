#include "core/tour/station_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/cover/bonds.h"
#include "core/cover/choose_stations.h"

namespace vantage::tour {
namespace {

// The goal where none is given, a share of what can be had. A choice: what is not worth a scan is
// left out afterwards.
constexpr double kNearlyAll = 0.98;
// An earlier tour is kept where a new one is not shorter by more scans than this.
constexpr size_t kWorthChanging = 1;
// Minutes: nobody sets up and scans in less. Keeps scanners that are said to need no time from
// being worth nothing.
constexpr double kShortestScan = 0.5;

// `area` is as large as `wanted`, but for rounding.
bool Reaches(double area, double wanted) { return area >= wanted * (1 - 1e-9); }

std::vector<uint32_t> Without(std::vector<uint32_t> stations, size_t k) {
  stations.erase(stations.begin() + static_cast<ptrdiff_t>(k));
  return stations;
}

}  // namespace

double StationChoice::GoalWeight() const {
  return request_.goal.value_or(kNearlyAll) * (AreaBefore() + table_.attainable()) - AreaBefore();
}

ChosenTour StationChoice::NoStations(bool reaches_goal) const {
  ChosenTour none;
  none.reaches_goal = reaches_goal;
  none.arrangement.done.assign(request_.scanners.size(), 0);
  return none;
}

std::optional<ChosenTour> StationChoice::Choose(const ChoiceEffort& effort,
                                                const std::vector<uint32_t>& known) {
  const cover::CoverProblem cover = arranger_.Links();
  // Where something is measured a scan has to register to it: the first station is not free.
  if (table_.overlap().AnyKnown() && cover.anchored.empty()) return NoStations(GoalWeight() <= 0);
  if (request_.minutes.has_value() || request_.scans.has_value()) {
    return ChooseWithinLimits(cover, effort);
  }
  return ChooseForGoal(cover, effort, known);
}

std::optional<ChosenTour> StationChoice::ChooseForGoal(const cover::CoverProblem& cover,
                                                       const ChoiceEffort& effort,
                                                       const std::vector<uint32_t>& known) {
  const double goal = GoalWeight();
  if (goal <= 0) return NoStations(true);
  auto chosen = cover::ChooseFewest(cover, goal, effort.choosing, known);
  if (!chosen.ok()) return std::nullopt;
  std::vector<uint32_t> stations = chosen->cover.stations;
  // Of the candidates that there are by now, whichever the best tour was chosen from.
  fewest_ = request_.goal.has_value() ? chosen->least : 0;
  fewest_of_ = table_.candidates().size();
  if (previous_ > 0) KeepPrevious(cover, goal, effort, stations);
  const bool trimmed =
      !request_.goal.has_value() && LeaveOutWhatIsNotWorthIt(cover, effort.arranging, stations);
  ChosenTour made = NoStations(false);
  made.arrangement = arranger_.Arrange(stations, effort.steps, effort.arranging, parallel_);
  if (!made.arrangement.finished || effort.arranging.Expired()) return std::nullopt;
  const double chosen_area = table_.Weight(stations);
  made.lost = chosen_area - made.arrangement.area;
  made.reaches_goal =
      chosen->complete && Reaches(made.arrangement.area, trimmed ? chosen_area : goal);
  return made;
}

// m^2 that each of the stations alone brings.
std::vector<double> StationChoice::OwnAreas(const std::vector<uint32_t>& stations) const {
  const std::vector<cover::ElementSet>& covers = table_.cover().covers;
  cover::ElementSet once = cover::EmptySet(table_.elements().weights.size());
  cover::ElementSet twice = once;
  for (const uint32_t station : stations) {
    for (size_t w = 0; w < once.size(); ++w) twice[w] |= once[w] & covers[station][w];
    cover::Unite(once, covers[station]);
  }
  std::vector<double> areas;
  areas.reserve(stations.size());
  for (const uint32_t station : stations) {
    cover::ElementSet own = covers[station];
    cover::Subtract(own, twice);
    areas.push_back(table_.Weight(own));
  }
  return areas;
}

// Takes out stations that bring less than a scan is worth beyond the others, the least first, if
// the others hang together without them. True when there were any.
bool StationChoice::LeaveOutWhatIsNotWorthIt(const cover::CoverProblem& cover,
                                             const parallel::Budget& budget,
                                             std::vector<uint32_t>& stations) const {
  const size_t before = stations.size();
  while (!budget.Expired()) {
    const std::vector<double> areas = OwnAreas(stations);
    std::vector<std::pair<double, size_t>> losses;
    for (size_t k = 0; k < stations.size(); ++k) {
      if (areas[k] < WorthAScan()) losses.emplace_back(areas[k], k);
    }
    std::sort(losses.begin(), losses.end());
    const auto leaves = std::find_if(losses.begin(), losses.end(), [&](const auto& loss) {
      return cover::HangTogether(cover, Without(stations, loss.second));
    });
    if (leaves == losses.end()) break;
    stations = Without(stations, leaves->second);
  }
  return stations.size() < before;
}

// Replaces the stations by those of the earlier tour that still pay and what is needed besides,
// where those are not more by more than kWorthChanging.
void StationChoice::KeepPrevious(const cover::CoverProblem& cover, double goal,
                                 const ChoiceEffort& effort,
                                 std::vector<uint32_t>& stations) const {
  std::vector<uint32_t> kept;
  for (uint32_t i = 0; i < previous_; ++i) kept.push_back(i);
  // What the others bring anyway is not gone for again: the least first.
  while (!kept.empty() && !effort.arranging.Expired()) {
    const std::vector<double> areas = OwnAreas(kept);
    const auto least = std::min_element(areas.begin(), areas.end());
    if (*least >= WorthAScan()) break;
    kept.erase(kept.begin() + (least - areas.begin()));
  }
  if (kept.empty()) return;
  // What is left to do beside them: their surface is done, and who links to them is anchored.
  const cover::ElementSet done = table_.Covered(kept);
  cover::CoverProblem rest = cover;
  for (cover::ElementSet& covers : rest.covers) cover::Subtract(covers, done);
  for (const uint32_t station : kept) {
    rest.anchored.insert(rest.anchored.end(), cover.links[station].begin(),
                         cover.links[station].end());
    rest.anchored.push_back(station);
  }
  std::sort(rest.anchored.begin(), rest.anchored.end());
  rest.anchored.erase(std::unique(rest.anchored.begin(), rest.anchored.end()), rest.anchored.end());
  const double left = goal - table_.Weight(done);
  std::vector<uint32_t> together = kept;
  if (left > 0) {
    auto more = cover::ChooseFewest(rest, left, effort.choosing);
    if (!more.ok()) return;
    for (const uint32_t station : more->cover.stations) {
      if (std::find(kept.begin(), kept.end(), station) == kept.end()) together.push_back(station);
    }
  }
  if (together.size() <= stations.size() + kWorthChanging) stations = std::move(together);
}

// That could be gone to within the limits, if nobody had to walk.
size_t StationChoice::MostStations() const {
  double least_minutes = std::numeric_limits<double>::infinity();
  for (const fleet::FleetMember& member : request_.scanners) {
    least_minutes = std::min(least_minutes, member.scan_seconds / 60);
  }
  size_t most = request_.scans.value_or(table_.candidates().size());
  if (request_.minutes.has_value()) {
    const double each = std::floor(*request_.minutes / std::max(least_minutes, 1e-3));  // at most
    const double all = each * static_cast<double>(request_.scanners.size());
    most = static_cast<size_t>(std::min(static_cast<double>(most), all));
  }
  return std::min(most, table_.candidates().size());
}

// The most stations whose tour stays within what is given, and of so many those that cover most.
std::optional<ChosenTour> StationChoice::ChooseWithinLimits(const cover::CoverProblem& cover,
                                                            const ChoiceEffort& effort) {
  std::optional<ChosenTour> best;
  const auto attempt = [&](size_t count) {
    auto chosen = cover::ChooseBest(cover, count, effort.choosing);
    if (!chosen.ok()) return false;
    ChosenTour made = NoStations(false);
    made.arrangement = arranger_.Arrange(chosen->stations, effort.steps, effort.whole, parallel_);
    if (!made.arrangement.finished || effort.whole.Expired()) return false;
    made.lost = chosen->weight - made.arrangement.area;
    made.reaches_goal = Reaches(made.arrangement.area, GoalWeight());
    if (request_.minutes.has_value() && made.arrangement.minutes > *request_.minutes + 1e-9) {
      return false;
    }
    if (!best.has_value() || made.arrangement.area > best->arrangement.area) {
      best = std::move(made);
    }
    return true;
  };
  const size_t most = MostStations();
  if (most == 0) return NoStations(GoalWeight() <= 0);
  if (attempt(most) || !request_.minutes.has_value()) return best;
  size_t possible = 0;
  size_t too_many = most;
  while (too_many - possible > 1) {
    const size_t middle = (possible + too_many) / 2;
    (attempt(middle) ? possible : too_many) = middle;
  }
  if (!best.has_value() && !effort.whole.Expired()) {
    return NoStations(GoalWeight() <= 0);  // not even one
  }
  return best;
}

bool StationChoice::Better(const ChosenTour& a, const ChosenTour& b) const {
  if (request_.minutes.has_value() || request_.scans.has_value()) {
    if (a.arrangement.area != b.arrangement.area) return a.arrangement.area > b.arrangement.area;
    return a.arrangement.minutes < b.arrangement.minutes;
  }
  if (!request_.goal.has_value()) return Value(a) > Value(b);
  // What is attainable grows with the candidates, and the goal with it.
  const bool reaches = Reaches(a.arrangement.area, GoalWeight());
  const bool other_reaches = Reaches(b.arrangement.area, GoalWeight());
  if (reaches != other_reaches) return reaches;
  if (!reaches && a.arrangement.area != b.arrangement.area) {
    return a.arrangement.area > b.arrangement.area;
  }
  return a.arrangement.minutes < b.arrangement.minutes;
}

// m^2, less what everybody's time is worth: a scan has to bring so much.
double StationChoice::Value(const ChosenTour& chosen) const {
  double scans = 0;  // that could be made in the time that all take
  for (size_t s = 0; s < chosen.arrangement.done.size(); ++s) {
    scans += chosen.arrangement.minutes /
             std::max(kShortestScan, request_.scanners[s].scan_seconds / 60);
  }
  return chosen.arrangement.area - WorthAScan() * scans;
}

}  // namespace vantage::tour
