#include "core/tour/make_tour.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/cover/choose_stations.h"
#include "core/tour/arrangement.h"
#include "core/tour/overlap_table.h"
#include "core/tour/spread_views.h"
#include "core/tour/tour_table.h"
#include "core/tour/ways.h"
#include "core/tour/worth_curve.h"

namespace vantage::tour {
namespace {

constexpr double kNearlyAll = 0.98;   // the goal where none is given
constexpr size_t kElements = 32'768;  // of the table
constexpr size_t kChecked = 131'072;  // others, by which the answer is measured
constexpr size_t kFirstCandidates = 160;
constexpr int kRefinements = 3;
constexpr int kChoices = 2;  // made anew where some of the chosen would not register
// Of the search for an order, by round.
constexpr size_t kFirstSteps = 50'000;
constexpr size_t kSteps = 500'000;
// Work of a choice, as cover counts it: some nanoseconds each.
constexpr uint64_t kFirstChoice = 100'000'000;
constexpr uint64_t kChoice = 1'000'000'000;
// Work of a choice for each ray that the budget allows: both take some nanoseconds, and choosing is
// to have a fifth of the time.
constexpr uint64_t kChoicePerRay = 5;
// By how much arranging may go beyond the budget, of it, and s at least: what was chosen would be
// for nothing otherwise.
constexpr double kShareBeyond = 0.1;
constexpr double kLeastBeyond = 5;
constexpr double kShareOfChoice = 0.2;  // of the time that is left
// An earlier tour is kept where a new one is not shorter by more scans than this.
constexpr size_t kWorthChanging = 1;
constexpr double kSamePlace = 0.5;  // m
constexpr size_t kOpenPlaces = 10;
constexpr uint64_t kBytesOfSight = 8;  // an element and a share
constexpr size_t kFewestNew = 8;       // candidates, for which a round is worth its while
constexpr double kShortestScan = 0.5;  // minutes: nobody sets up and scans in less

absl::Status Wrong(const std::string& what) { return absl::InvalidArgumentError(what); }

auto FiguresOf(const sensor::ScannerModel& m) {
  return std::tie(m.azimuth_span, m.elevation_min, m.elevation_max, m.azimuth_step,
                  m.elevation_step, m.range_min, m.range_max, m.range_noise, m.range_noise_ppm,
                  m.max_incidence, m.clearance, m.positioning_error);
}

absl::Status Validate(const planning::PlanningProblem& problem, const TourRequest& request) {
  if (request.scanners.empty()) return Wrong("tour: name at least one scanner");
  for (size_t s = 0; s < request.scanners.size(); ++s) {
    const fleet::FleetMember& member = request.scanners[s];
    if (FiguresOf(member.model) != FiguresOf(problem.scanner())) {
      return Wrong(absl::StrCat("tour: scanners[", s,
                                "] is of another model than the rest; a tour is made for scanners "
                                "of one model"));
    }
    if (!(member.speed > 0) || !std::isfinite(member.speed) || !(member.scan_seconds >= 0) ||
        !std::isfinite(member.scan_seconds) || (member.at.has_value() && !member.at->allFinite())) {
      return Wrong(absl::StrCat("tour: scanners[", s,
                                "] needs a speed above 0 m/s, scan_seconds of at least 0 and a "
                                "finite place"));
    }
  }
  if (request.goal.has_value() && !(*request.goal > 0 && *request.goal <= 1)) {
    return Wrong("tour: goal must be in (0, 1]");
  }
  if (request.minutes.has_value() && !(*request.minutes > 0)) {
    return Wrong("tour: minutes must be above 0");
  }
  if (request.scans == size_t{0}) return Wrong("tour: scans must be above 0");
  if (request.day.has_value() && !(*request.day > 0)) return Wrong("tour: day must be above 0");
  if (request.most_candidates < 1) return Wrong("tour: most_candidates must be above 0");
  for (size_t i = 0; i < request.hours.size(); ++i) {
    const RoomHours& hours = request.hours[i];
    if (const std::string fault = planning::OutlineFault(hours.room.outline); !fault.empty()) {
      return Wrong(absl::StrCat("tour: hours[", i, "].room ", fault));
    }
    if (!(hours.open.from >= 0 && hours.open.until > hours.open.from)) {
      return Wrong(absl::StrCat("tour: hours[", i, "] must open before it closes"));
    }
  }
  if (!request.previous.empty() && (request.minutes.has_value() || request.scans.has_value())) {
    return Wrong("tour: previous goes with a goal, not with minutes or scans");
  }
  for (const Eigen::Vector3d& place : request.previous) {
    if (!place.allFinite()) return Wrong("tour: previous needs finite places");
  }
  return absl::OkStatus();
}

std::string Hours(double minutes) {
  const auto whole = static_cast<int>(std::lround(minutes));
  if (whole < 60) return absl::StrFormat("%d min", whole);
  return absl::StrFormat("%d h %02d min", whole / 60, whole % 60);
}

class TourMaker {
 public:
  TourMaker(const planning::PlanningProblem& problem, const TourRequest& request,
            const parallel::Budget& budget, parallel::Parallel& parallel, TourProgress progress)
      : problem_(problem),
        request_(request),
        budget_(budget),
        parallel_(parallel),
        progress_(progress),
        ways_(problem) {}

  absl::StatusOr<Tour> Make() {
    // There is an answer, however late: the first round heeds cancellation only.
    parallel::Budget first = parallel::Budget::Unlimited();
    first.cancelled = budget_.cancelled;
    auto overlap = OverlapTable::Create(problem_, parallel_, parallel::Cancellation(first));
    if (!overlap.ok()) return overlap.status();
    overlap_.emplace(*std::move(overlap));
    elements_ = GainElements::Of(problem_, kElements, 0, parallel_);
    checked_ = GainElements::Of(problem_, kChecked, 1, parallel_);
    table_.emplace(problem_, *overlap_, elements_);
    arranger_.emplace(problem_, request_, *table_, ways_);
    if (absl::Status found = FindPrevious(first); !found.ok()) return found;

    const double spacing = SpacingFor(problem_);
    const size_t few = std::min(kFirstCandidates, request_.most_candidates);
    if (absl::Status added = Add(SpreadViews(problem_, 2 * spacing, few), first); !added.ok()) {
      return added;
    }
    if (table_->candidates().empty()) {
      return absl::FailedPreconditionError("tour: there is nowhere to stand in the model");
    }
    Round(first, kFirstChoice, kFirstSteps);
    if (!best_.has_value()) return absl::CancelledError("tour");
    Show(false);
    if (Refine({}, spacing, Affordable())) {
      double finer = spacing;
      for (int k = 0; k < kRefinements; ++k) {
        finer = std::max(problem_.feasible().cell_size(), finer / 2);
        const size_t before = best_number_;
        if (!Refine(Chosen(), finer, Affordable())) break;
        if (best_number_ == before || finer <= problem_.feasible().cell_size()) break;
      }
    }
    return Show(!cut_ && !budget_.Expired() && Spent() < budget_.work_limit);
  }

 private:
  absl::Status Add(std::span<const Candidate> candidates, const parallel::Budget& budget) {
    std::vector<Candidate> within;
    for (const Candidate& candidate : candidates) {
      const bool may = std::any_of(
          request_.scanners.begin(), request_.scanners.end(), [&](const fleet::FleetMember& m) {
            return m.reach.empty() ||
                   std::any_of(m.reach.begin(), m.reach.end(),
                               [&](const auto& box) { return box.contains(candidate.position); });
          });
      if (may) within.push_back(candidate);
    }
    return table_->Add(within, budget, parallel_);
  }

  absl::Status FindPrevious(const parallel::Budget& first) {
    std::vector<Candidate> found;
    for (const Eigen::Vector3d& place : request_.previous) {
      if (auto view = NearestView(problem_, place, kSamePlace); view.has_value()) {
        if (!problem_.scanner().TurnsAllAround()) continue;
        found.push_back(*view);
      }
    }
    if (found.empty()) return absl::OkStatus();
    absl::Status added = Add(found, first);
    if (!added.ok()) return added;
    previous_ = table_->candidates().size();
    return absl::OkStatus();
  }

  uint64_t Spent() const { return table_->rays() + arranger_->rays() + rays_; }
  // Candidates that the rest of a work limit is enough for, at what one took so far.
  size_t Affordable() const {
    const size_t most = request_.most_candidates;
    const uint64_t limit = budget_.work_limit;
    if (limit == std::numeric_limits<uint64_t>::max()) return most;
    const uint64_t left = limit - std::min(limit, Spent());
    const uint64_t each = std::max<uint64_t>(1, table_->rays() / table_->candidates().size());
    return std::min<size_t>(most, left / each / 2);
  }

  // False when nothing was tried: there is no budget left, or no candidate is new.
  bool Refine(const std::vector<Candidate>& beside, double spacing, size_t most) {
    const parallel::Budget evaluating = budget_.Evaluating();
    cut_ = cut_ || most < request_.most_candidates;
    if (most < kFewestNew || evaluating.Expired() || Spent() >= budget_.work_limit) return false;
    const size_t before = table_->candidates().size();
    if (!Add(SpreadViews(problem_, spacing, most, beside), evaluating).ok()) return false;
    if (table_->candidates().size() == before) return false;
    Round(evaluating, kChoice, kSteps);
    if (improved_) Show(false);
    return true;
  }

  double Before() const { return problem_.coverage().area_at_density; }
  // m^2 of the table's elements that have to be brought.
  double GoalWeight() const {
    return request_.goal.value_or(kNearlyAll) * (Before() + table_->attainable()) - Before();
  }

  // Chooses from the table as it is now, arranges, and keeps what is better.
  void Round(const parallel::Budget& budget, uint64_t choice_work, size_t steps) {
    improved_ = false;
    for (int k = 0; k < kChoices; ++k) {
      std::optional<Made> made = ChooseAndArrange(budget, choice_work, steps);
      if (!made.has_value()) return;
      const bool again = made->lost > 0 && made->lost >= WorthAScan();
      Keep(*std::move(made));
      if (!again || budget.Expired()) return;
    }
  }

  struct Made {
    Arrangement arrangement;
    bool reaches_goal = false;
    double lost = 0;  // m^2, by stations that were left out since they would not register
  };
  // A tour of no station.
  Made Nothing(bool reaches_goal) const {
    Made made;
    made.reaches_goal = reaches_goal;
    made.arrangement.done.assign(request_.scanners.size(), 0);
    return made;
  }

  // The budget of an order: that of the first tour is cancellation alone, since there is to be an
  // answer.
  parallel::Budget OfOrder() const {
    parallel::Budget part = parallel::Budget::Unlimited();
    part.cancelled = budget_.cancelled;
    part.now = budget_.now;
    if (best_.has_value() && budget_.deadline != parallel::Budget::Clock::time_point::max()) {
      const std::chrono::duration<double> whole = budget_.deadline - began_;
      const std::chrono::duration<double> beyond(
          std::max(kLeastBeyond, kShareBeyond * whole.count()));
      part.deadline =
          budget_.deadline + std::chrono::duration_cast<parallel::Budget::Clock::duration>(beyond);
    }
    return part;
  }

  parallel::Budget OfChoice(const parallel::Budget& budget, uint64_t work) const {
    parallel::Budget part = budget;
    part.work_limit = std::numeric_limits<uint64_t>::max();
    part = part.Part(kShareOfChoice, 0);
    part.work_limit = work;
    if (budget_.work_limit < work / kChoicePerRay) {
      part.work_limit = kChoicePerRay * budget_.work_limit;
    }
    return part;
  }

  std::optional<Made> ChooseAndArrange(const parallel::Budget& budget, uint64_t work,
                                       size_t steps) {
    const cover::CoverProblem cover = arranger_->Links();
    const parallel::Budget choosing = OfChoice(budget, work);
    // Where something is measured a scan has to register to it: the first station is not free.
    if (overlap_->AnyKnown() && cover.anchored.empty()) return Nothing(GoalWeight() <= 0);
    if (request_.minutes.has_value() || request_.scans.has_value()) {
      return WithinLimits(cover, choosing, budget, steps);
    }
    const double goal = GoalWeight();
    if (goal <= 0) return Nothing(true);
    Made made = Nothing(false);
    // What was found from fewer candidates is where the search begins.
    std::vector<uint32_t> known;
    if (best_.has_value()) {
      for (const ArrangedStop& stop : best_->arrangement.stops) known.push_back(stop.candidate);
    }
    auto chosen = cover::ChooseFewest(cover, goal, choosing, known);
    if (!chosen.ok()) return std::nullopt;
    std::vector<uint32_t> stations = chosen->cover.stations;
    // Of the candidates that there are by now, whichever the best tour was chosen from.
    fewest_ = request_.goal.has_value() ? chosen->least : 0;
    fewest_of_ = table_->candidates().size();
    const parallel::Budget arranging = OfOrder();
    if (previous_ > 0) KeepPrevious(cover, goal, choosing, arranging, stations);
    const bool trimmed =
        !request_.goal.has_value() && LeaveOutWhatIsNotWorthIt(cover, arranging, stations);
    made.arrangement = arranger_->Arrange(stations, steps, arranging, parallel_);
    if (!made.arrangement.finished || arranging.Expired()) return std::nullopt;
    const double chosen_area = table_->Weight(stations);
    made.lost = chosen_area - made.arrangement.area;
    made.reaches_goal =
        chosen->complete && made.arrangement.area >= (trimmed ? chosen_area : goal) * (1 - 1e-9);
    return made;
  }

  // m^2 by which a plan judges whether a scan is worth it.
  double WorthAScan() const { return problem_.config().terminate_below; }

  // m^2 that each of the stations alone brings.
  std::vector<double> OwnAreas(const std::vector<uint32_t>& stations) const {
    const std::vector<cover::ElementSet>& covers = table_->cover().covers;
    cover::ElementSet once((elements_.weights.size() + 63) / 64, 0);
    cover::ElementSet twice = once;
    for (const uint32_t station : stations) {
      for (size_t w = 0; w < once.size(); ++w) {
        twice[w] |= once[w] & covers[station][w];
        once[w] |= covers[station][w];
      }
    }
    std::vector<double> areas;
    areas.reserve(stations.size());
    for (const uint32_t station : stations) {
      cover::ElementSet own = covers[station];
      for (size_t w = 0; w < own.size(); ++w) own[w] &= ~twice[w];
      areas.push_back(table_->Weight(own));
    }
    return areas;
  }

  // Takes out stations that bring less than a scan is worth beyond the others, the least first, if
  // the others hang together without them. True when there were any.
  bool LeaveOutWhatIsNotWorthIt(const cover::CoverProblem& cover, const parallel::Budget& budget,
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
        return HangTogether(cover, Without(stations, loss.second));
      });
      if (leaves == losses.end()) break;
      stations = Without(stations, leaves->second);
    }
    return stations.size() < before;
  }
  static std::vector<uint32_t> Without(std::vector<uint32_t> stations, size_t k) {
    stations.erase(stations.begin() + static_cast<ptrdiff_t>(k));
    return stations;
  }
  // Whether there is an order in which each registers.
  static bool HangTogether(const cover::CoverProblem& cover,
                           const std::vector<uint32_t>& stations) {
    std::vector<uint32_t> reached;
    std::vector<uint8_t> done(stations.size(), 0);
    for (size_t k = 0; k < stations.size(); ++k) {
      const bool root =
          cover.anchored.empty()
              ? k == 0
              : std::binary_search(cover.anchored.begin(), cover.anchored.end(), stations[k]);
      if (!root) continue;
      done[k] = 1;
      reached.push_back(stations[k]);
    }
    for (size_t at = 0; at < reached.size(); ++at) {
      const std::vector<uint32_t>& links = cover.links[reached[at]];
      for (size_t k = 0; k < stations.size(); ++k) {
        if (done[k] != 0 || !std::binary_search(links.begin(), links.end(), stations[k])) continue;
        done[k] = 1;
        reached.push_back(stations[k]);
      }
    }
    return reached.size() == stations.size();
  }

  // Replaces the stations by those of the earlier tour that still pay and what is needed besides,
  // where those are not more by more than kWorthChanging.
  void KeepPrevious(const cover::CoverProblem& cover, double goal, const parallel::Budget& choosing,
                    const parallel::Budget& arranging, std::vector<uint32_t>& stations) const {
    std::vector<uint32_t> kept;
    for (uint32_t i = 0; i < previous_; ++i) kept.push_back(i);
    // What the others bring anyway is not gone for again: the least first.
    while (!kept.empty() && !arranging.Expired()) {
      const std::vector<double> areas = OwnAreas(kept);
      const auto least = std::min_element(areas.begin(), areas.end());
      if (*least >= WorthAScan()) break;
      kept.erase(kept.begin() + (least - areas.begin()));
    }
    if (kept.empty()) return;
    // What is left to do beside them: their surface is done, and who links to them is anchored.
    const cover::ElementSet done = table_->Covered(kept);
    cover::CoverProblem rest = cover;
    for (cover::ElementSet& covers : rest.covers) {
      for (size_t w = 0; w < covers.size(); ++w) covers[w] &= ~done[w];
    }
    for (const uint32_t station : kept) {
      rest.anchored.insert(rest.anchored.end(), cover.links[station].begin(),
                           cover.links[station].end());
      rest.anchored.push_back(station);
    }
    std::sort(rest.anchored.begin(), rest.anchored.end());
    rest.anchored.erase(std::unique(rest.anchored.begin(), rest.anchored.end()),
                        rest.anchored.end());
    const double left = goal - table_->Weight(done);
    std::vector<uint32_t> together = kept;
    if (left > 0) {
      auto more = cover::ChooseFewest(rest, left, choosing);
      if (!more.ok()) return;
      for (const uint32_t station : more->cover.stations) {
        if (std::find(kept.begin(), kept.end(), station) == kept.end()) together.push_back(station);
      }
    }
    if (together.size() <= stations.size() + kWorthChanging) stations = std::move(together);
  }

  // The most stations whose tour stays within what is given, and of so many those that cover most.
  std::optional<Made> WithinLimits(const cover::CoverProblem& cover,
                                   const parallel::Budget& choosing, const parallel::Budget& budget,
                                   size_t steps) {
    double least_minutes = std::numeric_limits<double>::infinity();
    for (const fleet::FleetMember& member : request_.scanners) {
      least_minutes = std::min(least_minutes, member.scan_seconds / 60);
    }
    size_t most = request_.scans.value_or(table_->candidates().size());
    if (request_.minutes.has_value()) {
      const double each = std::floor(*request_.minutes / std::max(least_minutes, 1e-3));  // at most
      const double all = each * static_cast<double>(request_.scanners.size());
      most = static_cast<size_t>(std::min(static_cast<double>(most), all));
    }
    most = std::min(most, table_->candidates().size());
    std::optional<Made> best;
    const auto attempt = [&](size_t count) {
      auto chosen = cover::ChooseBest(cover, count, choosing);
      if (!chosen.ok()) return false;
      Made made = Nothing(false);
      made.arrangement = arranger_->Arrange(chosen->stations, steps, budget, parallel_);
      if (!made.arrangement.finished || budget.Expired()) return false;
      made.lost = chosen->weight - made.arrangement.area;
      made.reaches_goal = made.arrangement.area >= GoalWeight() * (1 - 1e-9);
      if (request_.minutes.has_value() && made.arrangement.minutes > *request_.minutes + 1e-9) {
        return false;
      }
      if (!best.has_value() || made.arrangement.area > best->arrangement.area) {
        best = std::move(made);
      }
      return true;
    };
    if (most == 0) return Nothing(GoalWeight() <= 0);
    if (attempt(most) || !request_.minutes.has_value()) return best;
    size_t possible = 0;
    size_t too_many = most;
    while (too_many - possible > 1) {
      const size_t middle = (possible + too_many) / 2;
      (attempt(middle) ? possible : too_many) = middle;
    }
    if (!best.has_value() && !budget.Expired()) return Nothing(GoalWeight() <= 0);  // not even one
    return best;
  }

  bool Better(const Made& a, const Made& b) const {
    if (request_.minutes.has_value() || request_.scans.has_value()) {
      if (a.arrangement.area != b.arrangement.area) return a.arrangement.area > b.arrangement.area;
      return a.arrangement.minutes < b.arrangement.minutes;
    }
    if (!request_.goal.has_value()) return Value(a) > Value(b);
    // What is attainable grows with the candidates, and the goal with it.
    const double goal = GoalWeight();
    const bool reaches = a.arrangement.area >= goal * (1 - 1e-9);
    const bool other_reaches = b.arrangement.area >= goal * (1 - 1e-9);
    if (reaches != other_reaches) return reaches;
    if (!reaches && a.arrangement.area != b.arrangement.area) {
      return a.arrangement.area > b.arrangement.area;
    }
    return a.arrangement.minutes < b.arrangement.minutes;
  }

  // m^2, less what everybody's time is worth: a scan has to bring so much.
  double Value(const Made& made) const {
    double scans = 0;  // that could be made in the time that all take
    for (size_t s = 0; s < made.arrangement.done.size(); ++s) {
      scans += made.arrangement.minutes /
               std::max(kShortestScan, request_.scanners[s].scan_seconds / 60);
    }
    return made.arrangement.area - WorthAScan() * scans;
  }

  void Keep(Made made) {
    if (best_.has_value() && !Better(made, *best_)) return;
    best_ = std::move(made);
    improved_ = true;
    ++best_number_;
  }

  std::vector<Candidate> Chosen() const {
    std::vector<Candidate> chosen;
    for (const ArrangedStop& stop : best_->arrangement.stops) {
      chosen.push_back(table_->candidates()[stop.candidate]);
    }
    return chosen;
  }

  // The best tour, with its figures, shown and returned.
  Tour Show(bool complete) {
    Tour tour = Describe();
    tour.complete = complete;
    progress_(tour);
    return tour;
  }

  Tour Describe() {
    const Arrangement& made = best_->arrangement;
    Tour tour;
    // Of a tour that was cancelled nobody reads the figures.
    parallel::Budget unlimited = parallel::Budget::Unlimited();
    unlimited.cancelled = budget_.cancelled;
    const cover::ElementSet none((checked_.weights.size() + 63) / 64, 0);
    std::vector<cover::ElementSet> brought(made.stops.size());
    std::vector<uint64_t> rays(made.stops.size(), 0);
    std::vector<std::vector<Eigen::Vector3d>> ways(made.stops.size());
    parallel_.For(made.stops.size(), [&](size_t k) {
      const ArrangedStop& stop = made.stops[k];
      const Candidate& candidate = table_->candidates()[stop.candidate];
      brought[k] = Brought(problem_, candidate, checked_, unlimited, rays[k]).value_or(none);
      if (unlimited.Expired()) return;
      std::optional<Eigen::Vector3d> from;
      if (stop.after.has_value()) {
        from = table_->candidates()[*stop.after].position;
      } else if (stop.day == 0) {
        from = arranger_->StartOf(stop.scanner);
      }
      if (from.has_value()) ways[k] = ways_.Way(*from, candidate.position);
    });
    const double to_checked = elements_.total > 0 ? checked_.total / elements_.total : 1;
    tour.attainable = table_->attainable() * to_checked;
    tour.area_before = Before();
    tour.scanner_minutes = made.done;
    tour.minutes = made.minutes;
    cover::ElementSet so_far = none;
    double area = 0;
    std::vector<double> areas;
    for (size_t k = 0; k < made.stops.size(); ++k) {
      rays_ += rays[k];
      for (size_t w = 0; w < so_far.size(); ++w) so_far[w] |= brought[k][w];
      double now = 0;
      for (size_t i = 0; i < checked_.weights.size(); ++i) {
        if ((so_far[i / 64] >> (i % 64) & 1) != 0) now += checked_.weights[i];
      }
      areas.push_back(now - area);
      area = now;
    }
    tour.area = area;
    tour.attainable = std::max(tour.attainable, area);
    tour.out_of_reach = std::max(0.0, checked_.total - tour.attainable);
    const double all = tour.area_before + tour.attainable;
    const auto share = [&](double brought_area) {
      return all > 0 ? (tour.area_before + brought_area) / all : 1;
    };
    tour.coverage_before = share(0);
    tour.coverage = share(area);
    area = 0;
    const std::vector<std::vector<uint32_t>> linked = arranger_->Links().links;
    for (size_t k = 0; k < made.stops.size(); ++k) {
      const ArrangedStop& from = made.stops[k];
      const Candidate& candidate = table_->candidates()[from.candidate];
      TourStop& stop = tour.stops.emplace_back();
      stop.position = candidate.position;
      stop.heading = candidate.heading;
      stop.scanner = from.scanner;
      stop.storey = candidate.storey;
      stop.expected = problem_.BasisOf(candidate.position) == planning::StationBasis::kExpected;
      stop.kept = from.candidate < previous_;
      tour.kept += stop.kept ? 1 : 0;
      stop.way = std::move(ways[k]);
      for (size_t i = 1; i < stop.way.size(); ++i) {
        stop.way_length += (stop.way[i] - stop.way[i - 1]).head<2>().norm();
      }
      tour.walked += stop.way_length;
      stop.wait = from.wait;
      stop.start = from.start;
      stop.end = from.end;
      stop.day = from.day;
      area += areas[k];
      stop.area = areas[k];
      stop.coverage = share(area);
      stop.verdict = from.verdict;
      const std::vector<uint32_t>& links = linked[from.candidate];
      for (size_t j = 0; j < k; ++j) {
        if (made.stops[j].end <= from.start + 1e-9 &&
            std::binary_search(links.begin(), links.end(), made.stops[j].candidate)) {
          stop.registers_with.push_back(j);
        }
      }
    }
    // Candidates that came since may do with fewer, and raise the goal.
    tour.candidates = table_->candidates().size();
    tour.fewest = fewest_of_ == tour.candidates ? fewest_ : 0;
    tour.reaches_goal = best_->reaches_goal &&
                        (!request_.goal.has_value() || made.area >= GoalWeight() * (1 - 1e-9));
    tour.not_registering = made.not_registering.size();
    for (const WorthStep& step : Worth(made, brought, unlimited)) {
      tour.worth.push_back({step.scans, step.minutes, step.area, share(step.area)});
    }
    tour.open = Open(so_far);
    tour.rays = Spent();
    tour.message = Message(tour);
    return tour;
  }

  // `brought`: by stop, the checked cells.
  std::vector<WorthStep> Worth(const Arrangement& made,
                               const std::vector<cover::ElementSet>& brought,
                               const parallel::Budget& budget) const {
    std::vector<cover::ElementSet> covers(made.stations.size());
    for (size_t i = 0; i < covers.size(); ++i) {
      for (size_t k = 0; k < made.stops.size(); ++k) {
        if (made.stops[k].candidate == made.stations[i]) covers[i] = brought[k];
      }
    }
    return WorthCurve(made.order, made.routes, covers, checked_.weights, budget);
  }

  // Where most of what some candidate brings stays open: in cubes of two metres.
  std::vector<OpenPlace> Open(const cover::ElementSet& brought) const {
    constexpr double kEdge = 2;         // m
    constexpr double kLeastArea = 0.1;  // m^2
    const planning::CellArrays& cells = checked_.cells;
    struct Sum {
      std::array<int, 3> cube{};
      uint32_t element = 0;
    };
    std::vector<Sum> sums;
    for (uint32_t i = 0; i < checked_.weights.size(); ++i) {
      if ((brought[i / 64] >> (i % 64) & 1) != 0) continue;
      const auto at = [&](float v) { return static_cast<int>(std::floor(v / kEdge)); };
      sums.push_back({{at(cells.x[i]), at(cells.y[i]), at(cells.z[i])}, i});
    }
    std::stable_sort(sums.begin(), sums.end(),
                     [](const Sum& a, const Sum& b) { return a.cube < b.cube; });
    std::vector<OpenPlace> places;
    for (size_t begin = 0; begin < sums.size();) {
      size_t end = begin;
      OpenPlace place;
      for (; end < sums.size() && sums[end].cube == sums[begin].cube; ++end) {
        const uint32_t i = sums[end].element;
        place.area += checked_.weights[i];
        place.position += checked_.weights[i] * Eigen::Vector3d(cells.x[i], cells.y[i], cells.z[i]);
      }
      place.position /= place.area;
      if (place.area >= kLeastArea) places.push_back(place);
      begin = end;
    }
    std::stable_sort(places.begin(), places.end(),
                     [](const OpenPlace& a, const OpenPlace& b) { return a.area > b.area; });
    if (places.size() > kOpenPlaces) places.resize(kOpenPlaces);
    return places;
  }

  std::string Message(const Tour& tour) const {
    const double point = 1 / std::sqrt(problem_.config().required_density);
    const size_t scans = tour.stops.size();
    if (scans == 0) {
      return absl::StrFormat(
          "%s: %.0f %% at %.3g cm",
          overlap_->AnyKnown() && arranger_->Links().anchored.empty()
              ? "no place is known at which a scan would register to those that were made"
              : "nothing to go for",
          100 * tour.coverage, 100 * point);
    }
    std::string said =
        absl::StrFormat("%d station%s, %s, %.0f %% at %.3g cm", scans, scans == 1 ? "" : "s",
                        Hours(tour.minutes), 100 * tour.coverage, 100 * point);
    const size_t points = tour.worth.size();
    if (points > 2) {
      absl::StrAppendFormat(
          &said, "; the last two scans bring %.1f %%",
          100 * (tour.worth[points - 1].coverage - tour.worth[points - 3].coverage));
    }
    if (const size_t closed = best_->arrangement.closed.size(); closed > 0) {
      absl::StrAppendFormat(
          &said, "; %d station%s left out: the room is closed when anybody could be there", closed,
          closed == 1 ? " is" : "s are");
    }
    return said;
  }

  const planning::PlanningProblem& problem_;
  const TourRequest& request_;
  const parallel::Budget& budget_;
  parallel::Parallel& parallel_;
  TourProgress progress_;
  Ways ways_;
  GainElements elements_;
  GainElements checked_;
  std::optional<OverlapTable> overlap_;
  std::optional<TourTable> table_;
  std::optional<Arranger> arranger_;
  size_t previous_ = 0;  // the first candidates are those of the earlier tour
  std::optional<Made> best_;
  size_t best_number_ = 0;
  bool improved_ = false;
  size_t fewest_ = 0;
  size_t fewest_of_ = 0;
  bool cut_ = false;  // fewer candidates were tried than asked for
  const parallel::Budget::Clock::time_point began_ = budget_.now();
  uint64_t rays_ = 0;
};

}  // namespace

absl::StatusOr<Tour> MakeTour(const planning::PlanningProblem& problem, const TourRequest& request,
                              const parallel::Budget& budget, parallel::Parallel& parallel,
                              TourProgress progress) {
  if (absl::Status valid = Validate(problem, request); !valid.ok()) return valid;
  return TourMaker(problem, request, budget, parallel, progress).Make();
}

uint64_t EstimateTourMemory(const TourRequest& request) {
  // Of a candidate: its bits, what it sees of some twenty thousand elements at most, and links.
  constexpr uint64_t kSeen = 24'000;
  // Tables are copied for the choice, and again by it.
  constexpr uint64_t kCopies = 3;
  const uint64_t candidates =
      (1 + kRefinements) * request.most_candidates + kFirstCandidates + request.previous.size();
  const uint64_t each = kCopies * (kElements / 8 + 4 * candidates) + kSeen * kBytesOfSight;
  // Cells that are counted and checked, with what scorers read of them, twice while they are made.
  constexpr uint64_t kBytesOfCell = 120;
  return candidates * each + 2 * (kElements + kChecked) * kBytesOfCell;
}

}  // namespace vantage::tour
