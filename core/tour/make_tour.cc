#include "core/tour/make_tour.h"

#include <algorithm>
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
#include "core/registration/bound/rival_forecast.h"
#include "core/tour/arrangement.h"
#include "core/tour/describe_tour.h"
#include "core/tour/overlap_table.h"
#include "core/tour/spread_views.h"
#include "core/tour/station_choice.h"
#include "core/tour/tour_table.h"
#include "core/tour/ways.h"

namespace vantage::tour {
namespace {

// Elements that stations are chosen by, at most: on 1,000 m2 one stands for some hundred square
// centimetres of surface, far less than a station brings, and all candidates' sets take 20 MiB.
constexpr size_t kElements = 32'768;
// Others, by which the answer is measured: four times as many, asked of two dozen stations only.
constexpr size_t kChecked = 131'072;
// Candidates of the first round, at most: in a flat one for each square metre or two. Twice as many
// take four times as long to link, and the first tour is waited for.
constexpr size_t kFirstCandidates = 160;
constexpr int kRefinements = 3;
constexpr int kChoices = 2;  // made anew where some of the chosen would not register
// Of the search for an order, by round.
constexpr size_t kFirstSteps = 50'000;
constexpr size_t kSteps = 500'000;
// Work of a choice, as cover counts it: some nanoseconds each.
constexpr uint64_t kFirstChoice = 100'000'000;
constexpr uint64_t kChoice = 1'000'000'000;
// Of the time that is left, that choosing may take, (0, 1]: there are as many rounds to come.
constexpr double kShareOfChoice = 0.2;
// Work of a choice for each ray that the budget allows: both take some nanoseconds, and choosing is
// to have kShareOfChoice of the time.
constexpr uint64_t kChoicePerRay = 5;
// By how much arranging may go beyond the budget, of it, and s at least: what was chosen would be
// for nothing otherwise.
constexpr double kShareBeyond = 0.1;
constexpr double kLeastBeyond = 5;
constexpr uint64_t kBytesOfSight = 8;  // an element and a share
constexpr size_t kFewestNew = 8;       // candidates, for which a round is worth its while

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
  if (!request.previous.empty() && !problem.scanner().TurnsAllAround()) {
    return Wrong(
        "tour: previous goes with scanners that turn all around; it does not say where others "
        "face");
  }
  for (const Eigen::Vector3d& place : request.previous) {
    if (!place.allFinite()) return Wrong("tour: previous needs finite places");
  }
  return absl::OkStatus();
}

// Finds candidates, has stations chosen from them, and keeps the best tour of all rounds.
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
    std::optional<absl::StatusOr<OverlapTable>> overlap;
    parallel_.For(3, [&](size_t part) {
      if (part == 0) {
        overlap.emplace(OverlapTable::Create(problem_, parallel_, parallel::Cancellation(first)));
      }
      if (part == 1) elements_ = GainElements::Of(problem_, kElements, 0, parallel_);
      if (part == 2) checked_ = GainElements::Of(problem_, kChecked, 1, parallel_);
    });
    if (!overlap->ok()) return overlap->status();
    overlap_.emplace(**std::move(overlap));
    table_.emplace(problem_, *overlap_, elements_);
    arranger_.emplace(problem_, request_, *table_, ways_);
    choice_.emplace(problem_, request_, *table_, *arranger_, parallel_);
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
    Report(false);
    if (Refine({}, spacing, Affordable())) {
      double finer = spacing;
      for (int k = 0; k < kRefinements; ++k) {
        finer = std::max(problem_.feasible().cell_size(), finer / 2);
        const size_t before = best_number_;
        if (!Refine(BestStations(), finer, Affordable())) break;
        if (best_number_ == before || finer <= problem_.feasible().cell_size()) break;
      }
    }
    Tour tour = Report(!cut_ && !budget_.Expired() && Spent() < budget_.work_limit);
    // What was cancelled on the way has no figures.
    if (budget_.cancelled.stop_requested()) return absl::CancelledError("tour");
    return tour;
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
        found.push_back(*view);
      }
    }
    if (found.empty()) return absl::OkStatus();
    absl::Status added = Add(found, first);
    if (!added.ok()) return added;
    choice_->SetPrevious(table_->candidates().size());
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
    if (improved_) Report(false);
    return true;
  }

  // Chooses from the table as it is now, arranges, and keeps what is better.
  void Round(const parallel::Budget& budget, uint64_t choice_work, size_t steps) {
    improved_ = false;
    // The first tour is to be there soon; the rounds after it choose better.
    const int choices = best_.has_value() ? kChoices : 1;
    for (int k = 0; k < choices; ++k) {
      // What was found from fewer candidates is where the search begins.
      std::vector<uint32_t> known;
      if (best_.has_value()) {
        for (const ArrangedStop& stop : best_->arrangement.stops) known.push_back(stop.candidate);
      }
      std::optional<ChosenTour> chosen =
          choice_->Choose({ChoiceBudget(budget, choice_work), OrderBudget(), budget, steps}, known);
      if (!chosen.has_value()) return;
      const bool again = chosen->lost > 0 && chosen->lost >= choice_->WorthAScan();
      Keep(*std::move(chosen));
      if (!again || budget.Expired()) return;
    }
  }

  // The budget of an order: that of the first tour is cancellation alone, since there is to be an
  // answer.
  parallel::Budget OrderBudget() const {
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

  parallel::Budget ChoiceBudget(const parallel::Budget& budget, uint64_t work) const {
    parallel::Budget part = budget;
    part.work_limit = std::numeric_limits<uint64_t>::max();
    part = part.Part(kShareOfChoice, 0);
    part.work_limit = work;
    if (budget_.work_limit < work / kChoicePerRay) {
      part.work_limit = kChoicePerRay * budget_.work_limit;
    }
    return part;
  }

  void Keep(ChosenTour chosen) {
    if (best_.has_value() && !choice_->Better(chosen, *best_)) return;
    best_ = std::move(chosen);
    improved_ = true;
    ++best_number_;
  }

  std::vector<Candidate> BestStations() const {
    std::vector<Candidate> stations;
    for (const ArrangedStop& stop : best_->arrangement.stops) {
      stations.push_back(table_->candidates()[stop.candidate]);
    }
    return stations;
  }

  // The best tour, with its figures, told and returned; not told when it was cancelled on the way.
  Tour Report(bool complete) {
    Tour tour = DescribeTour({problem_, request_, *table_, *arranger_, *choice_, checked_, ways_},
                             *best_, budget_.cancelled, parallel_, rays_);
    tour.rays = Spent();
    tour.complete = complete;
    if (!budget_.cancelled.stop_requested()) progress_(tour);
    return tour;
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
  std::optional<StationChoice> choice_;
  std::optional<ChosenTour> best_;
  size_t best_number_ = 0;
  bool improved_ = false;
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
  // Of a candidate: its bits, what it sees of the elements at most (16,000 of the model's and
  // OverlapTable::kMostFalse), and links.
  constexpr uint64_t kSeen = 16'000 + OverlapTable::kMostFalse;
  // Tables are copied for the choice, and again by it.
  constexpr uint64_t kCopies = 3;
  const uint64_t candidates =
      (1 + kRefinements) * request.most_candidates + kFirstCandidates + request.previous.size();
  const uint64_t each = kCopies * (kElements / 8 + 4 * candidates) + kSeen * kBytesOfSight;
  // Cells that are counted and checked, with what scorers read of them, twice while they are made.
  constexpr uint64_t kBytesOfCell = 120;
  return candidates * each + 2 * (kElements + kChecked) * kBytesOfCell +
         registration::FieldAllOver::EstimatedBytes();
}

}  // namespace vantage::tour
