#include "core/tour/station_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/cover/choose_stations.h"
#include "core/tour/worthwhile_stations.h"

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

// By more than rounding.
bool TakesLonger(double minutes, double most) { return minutes > most + 1e-9; }

// `area` is as large as `wanted`, but for rounding.
bool Reaches(double area, double wanted) { return area >= wanted * (1 - 1e-9); }

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
  const double asked = chosen->complete ? goal : kNoWay;
  if (previous_ == 0) return Arranged(cover, std::move(stations), asked, effort);
  auto with = WithPrevious(cover, goal, stations.size() + kWorthChanging, effort);
  if (!with.has_value()) return Arranged(cover, std::move(stations), asked, effort);
  std::optional<ChosenTour> kept = Arranged(cover, *std::move(with), asked, effort);
  // Of one scanner so many stations are so many minutes. Several wait for each other where what
  // one of them was to go to one by one is all that is kept.
  if (request_.scanners.size() == 1 || !kept.has_value()) return kept;
  std::optional<ChosenTour> anew = Arranged(cover, std::move(stations), asked, effort);
  if (!anew.has_value()) return kept;
  double scan = 0;  // minutes
  for (const fleet::FleetMember& member : request_.scanners) {
    scan = std::max(scan, member.scan_seconds / 60);
  }
  const double most = anew->arrangement.minutes + static_cast<double>(kWorthChanging) * scan;
  const bool worse = anew->reaches_goal && !kept->reaches_goal;
  return worse || TakesLonger(kept->arrangement.minutes, most) ? anew : kept;
}

// The stations in their order, less those that are not worth a scan where no goal was given.
// `goal`: m^2 that they are chosen for; kNoWay where they do not come to it.
std::optional<ChosenTour> StationChoice::Arranged(const cover::CoverProblem& cover,
                                                  std::vector<uint32_t> stations, double goal,
                                                  const ChoiceEffort& effort) {
  const bool trimmed =
      !request_.goal.has_value() &&
      LeaveOutWhatIsNotWorthIt(cover, WorthAScan(), 0, effort.arranging, stations) > 0;
  ChosenTour made = NoStations(false);
  made.arrangement = arranger_.Arrange(stations, effort.steps, effort.arranging, parallel_);
  if (!made.arrangement.finished || effort.arranging.Expired()) return std::nullopt;
  const double chosen_area = table_.Weight(stations);
  made.lost = chosen_area - made.arrangement.area;
  made.reaches_goal =
      std::isfinite(goal) && Reaches(made.arrangement.area, trimmed ? chosen_area : goal);
  return made;
}

// The stations of the earlier tour that still pay and what is needed besides, where those are not
// more than `most`.
std::optional<std::vector<uint32_t>> StationChoice::WithPrevious(const cover::CoverProblem& cover,
                                                                 double goal, size_t most,
                                                                 const ChoiceEffort& effort) const {
  std::vector<uint32_t> previous;
  for (uint32_t i = 0; i < previous_; ++i) previous.push_back(i);
  // What the others bring anyway is not gone for again.
  const std::vector<uint32_t> kept =
      StationsToKeep(cover, previous, WorthAScan(), effort.arranging);
  if (kept.empty()) return std::nullopt;
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
    if (!more.ok()) return std::nullopt;
    for (const uint32_t station : more->cover.stations) {
      if (std::find(kept.begin(), kept.end(), station) == kept.end()) together.push_back(station);
    }
  }
  if (together.size() > most) return std::nullopt;
  return together;
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
    std::vector<uint32_t> stations = chosen->stations;
    // A goal is gone for whatever a station brings of it.
    const double goal = request_.goal.has_value() ? std::min(GoalWeight(), chosen->weight) : 0;
    ChosenTour made = NoStations(false);
    made.not_worth_it = LeaveOutWhatIsNotWorthIt(cover, WorthAScan(), goal, effort.whole, stations);
    made.arrangement = arranger_.Arrange(stations, effort.steps, effort.whole, parallel_);
    if (!made.arrangement.finished || effort.whole.Expired()) return false;
    made.lost = table_.Weight(stations) - made.arrangement.area;
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
