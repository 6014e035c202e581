#include "client/simulated_job/simulated_job.h"

#include <deque>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/geometry.h"
#include "client/simulated_job/attainable.h"

namespace vantage::simulated_job {
namespace {

using Eigen::Vector3d;

constexpr int kMostRefusals = 5;  // places in a row where nobody can stand

const v1::RankedView* FirstWithOverlap(
    const google::protobuf::RepeatedPtrField<v1::RankedView>& views, double overlap) {
  for (const v1::RankedView& view : views) {
    if (view.verdict().overlap_share() >= overlap) return &view;
  }
  return nullptr;
}

// Whether the best that a plan found is not worth a scan, while it cannot say so of all views: by
// what the plan itself goes by, square metres that come to density for sure and of what is
// expected, not by what comes with them unseen.
bool MayBeDone(const v1::PlanResult& plan) {
  if (plan.termination().suggested() || plan.views().empty()) return false;
  const v1::RankedView& best = plan.views(0);
  const std::optional<Promise> promise = PromiseOf(best);
  // Of a view that was not looked at to its end the score is all that is known.
  const double gain = promise ? promise->model_gain + promise->expected_surface
                              : best.score_upper() / plan.config().required_density_per_m2();
  return gain < plan.config().terminate_below_m2();
}

std::optional<double> HeadingOf(const v1::RankedView& view) {
  return view.has_heading_rad() ? std::optional(view.heading_rad()) : std::nullopt;
}

// The best view by the rule; null when there is none. Both lists are sorted, the best first.
const v1::RankedView* Choose(const v1::PlanResult& plan, ViewChoice choice) {
  if (choice == ViewChoice::kRegistrable) {
    return plan.outcome() == v1::PLAN_OUTCOME_VIEWS ? &plan.views(0) : nullptr;
  }
  const double overlap =
      choice == ViewChoice::kOverlap ? plan.config().registration().min_overlap() : 0;
  const v1::RankedView* passed = FirstWithOverlap(plan.views(), overlap);
  const v1::RankedView* refused = FirstWithOverlap(plan.refused(), overlap);
  if (passed == nullptr || refused == nullptr) return passed != nullptr ? passed : refused;
  return refused->score() > passed->score() ? refused : passed;
}

}  // namespace

std::optional<Promise> PromiseOf(const v1::RankedView& view) {
  // Both gains come of one computation; the bounds of one of them tell whether it was made.
  if (view.model_gain_lower_m2() < view.model_gain_upper_m2()) return std::nullopt;
  return Promise{view.expected_gain_m2(),        view.model_gain_m2(),
                 view.verdict().overlap_share(), view.expected_gain_lower_m2(),
                 view.expected_gain_upper_m2(),  view.model_gain_by_kind_m2(),
                 view.expected_surface_gain_m2()};
}

SimulatedJob::SimulatedJob(client::Client& client, const Site& site, const JobOptions& options,
                           parallel::Parallel& parallel)
    : SimulatedJob(client, site, options, std::make_unique<simulation::SimulatedScanner>(site.mesh),
                   parallel) {}

SimulatedJob::SimulatedJob(client::Client& client, const Site& site, const JobOptions& options,
                           std::unique_ptr<const simulation::SimulatedScanner> scanner,
                           parallel::Parallel& parallel)
    : SimulatedJob(
          client, site, options, *scanner,
          simulation::GroundTruth(site.mesh, *scanner, options.scanner, options.required_density,
                                  AllowedPositions(*scanner, site, options.scanner),
                                  options.truth_samples, parallel),
          parallel) {
  own_scanner_ = std::move(scanner);
}

SimulatedJob::SimulatedJob(client::Client& client, const Site& site, const JobOptions& options,
                           const simulation::SimulatedScanner& scanner,
                           const simulation::GroundTruth& truth, parallel::Parallel& parallel)
    : site_(site),
      options_(options),
      parallel_(parallel),
      truth_(truth),
      surveyor_(client, site, scanner, options, parallel) {}

SimulatedJob::~SimulatedJob() = default;

// The next place after a plan; nothing, with the reason, when the job ends with it.
SimulatedJob::Next SimulatedJob::NextAt(const v1::RankedView& view) {
  Next next{client::FromProto(view.position()), PromiseOf(view), HeadingOf(view), {}, {}};
  if (view.has_expected_station()) next.expected = view.expected_station();
  return next;
}

std::optional<SimulatedJob::Next> SimulatedJob::NextPosition(const v1::Plan& plan, bool more_comes,
                                                             JobResult& result,
                                                             std::vector<std::string>& notes) {
  const v1::PlanResult& answer = plan.result();
  if (answer.termination().suggested()) {
    if (!result.planner_stopped) result.stop_suggested_after = result.made;
    result.planner_stopped = true;
    result.why = absl::StrCat("the planner suggests to stop: ", answer.termination().message());
    if (options_.heed_termination) return std::nullopt;
  }
  if (answer.has_followed_tour()) notes.push_back(answer.followed_tour().message());
  if (const v1::RankedView* chosen = Choose(answer, options_.choice); chosen != nullptr) {
    if (chosen->has_floor_measured() && !chosen->floor_measured()) {
      notes.emplace_back("the floor below the next place was not measured");
    }
    return NextAt(*chosen);
  }
  if (answer.outcome() != v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW || answer.refused().empty()) {
    result.why = absl::StrCat("the planner has no view to offer: ", answer.message());
    return std::nullopt;
  }
  // Whose data are on their way fetches them before anybody goes where a scan is likely to be lost.
  const v1::RankedView* nearest = more_comes ? nullptr : surveyor_.NearestRefused(answer);
  if (nearest == nullptr) {
    result.why = absl::StrCat("no view will register: ", answer.message());
    return std::nullopt;
  }
  notes.push_back(
      absl::StrCat("no view is sure to register; taking the nearest refused one, "
                   "whose remedy is: ",
                   nearest->verdict().remedy()));
  return NextAt(*nearest);
}

absl::StatusOr<Cycle> SimulatedJob::Deliver(const OnItsWay& scan, JobResult& result) {
  auto made = surveyor_.Make(scan.placement, scan.number, "");
  if (!made.ok()) return made.status();
  Cycle cycle;
  static_cast<MadeScan&>(cycle) = *std::move(made);
  cycle.promised = scan.promised;
  cycle.notes.insert(cycle.notes.begin(), scan.notes.begin(), scan.notes.end());
  if (cycle.merged) {
    truth_.AddScan(cycle.at, parallel_, cycle.facing);
  } else {
    ++result.lost;
  }
  // Also where it was set up farther from its station than a scan of it can be.
  if (!scan.station.empty()) {
    if (absl::Status forgot = surveyor_.Forget(scan.station); !forgot.ok()) return forgot;
  }
  cycle.truth = truth_.Measure();
  return cycle;
}

absl::StatusOr<std::optional<SimulatedJob::Next>> SimulatedJob::FindNext(
    int number, bool more_comes, Cycle& cycle, JobResult& result, std::vector<std::string>& notes) {
  for (int refusals = 0; refusals <= kMostRefusals; ++refusals) {
    auto made_plan = surveyor_.Plan({}, v1::RANKING_UNSPECIFIED);
    if (!made_plan.ok()) return made_plan.status();
    if (options_.last_plan_work > 0 && MayBeDone(made_plan->plan.result())) {
      cycle.plan_seconds += made_plan->seconds;
      made_plan = surveyor_.Plan({}, v1::RANKING_UNSPECIFIED, options_.last_plan_work);
      if (!made_plan.ok()) return made_plan.status();
    }
    cycle.plan = std::move(made_plan->plan);
    cycle.plan_budget = made_plan->budget;
    cycle.plan_attempts = made_plan->attempts;
    cycle.plan_seconds += made_plan->seconds;
    std::optional<Next> next = NextPosition(cycle.plan, more_comes, result, notes);
    if (!next) return next;
    next->placement = surveyor_.At(next->position, number, next->heading);
    if (next->expected.has_value()) {
      next->placement =
          surveyor_.NearestFree(next->placement, number, *next->expected, next->heading);
    }
    const auto blocked = surveyor_.IsBlocked(next->placement);
    if (!blocked.ok()) return blocked.status();
    if (next->expected.has_value()) cycle.tried.push_back({next->expected->chance(), !*blocked});
    if (!*blocked) return next;
    cycle.notes.push_back(absl::StrFormat("nobody can stand at (%.2f, %.2f, %.2f)",
                                          next->position.x(), next->position.y(),
                                          next->position.z()));
    result.why = "the planner's views cannot be stood at";
  }
  return std::nullopt;
}

absl::StatusOr<JobResult> SimulatedJob::Run(
    absl::FunctionRef<absl::Status(const Cycle&)> on_cycle) {
  if (absl::Status can = CheckAttainable(truth_.Measure(), site_, options_.required_density);
      !can.ok()) {
    return can;
  }
  if (absl::Status opened = surveyor_.Open(); !opened.ok()) return opened;
  JobResult result;
  result.session = surveyor_.session();
  std::optional<Promise> promised;
  Placement placement = surveyor_.First();
  std::vector<std::string> notes;
  std::deque<OnItsWay> on_their_way;
  const auto deliver_all = [&]() -> absl::Status {
    for (; !on_their_way.empty(); on_their_way.pop_front()) {
      const absl::StatusOr<Cycle> delivered = Deliver(on_their_way.front(), result);
      if (!delivered.ok()) return delivered.status();
      if (absl::Status heard = on_cycle(*delivered); !heard.ok()) return heard;
    }
    return absl::OkStatus();
  };
  for (int number = 1; number <= options_.max_scans; ++number) {
    OnItsWay& latest = on_their_way.emplace_back();
    latest = {placement, number, promised, std::move(notes), ""};
    notes.clear();
    ++result.made;
    const bool waits = options_.late > 0 && number > 1;
    if (waits) {
      absl::StatusOr<std::string> station = surveyor_.Announce(placement);
      if (!station.ok()) return station.status();
      latest.station = *std::move(station);
    }
    // What came since the last plan.
    std::vector<Cycle> cycles;
    while (on_their_way.size() > static_cast<size_t>(waits ? options_.late : 0)) {
      absl::StatusOr<Cycle> delivered = Deliver(on_their_way.front(), result);
      if (!delivered.ok()) return delivered.status();
      on_their_way.pop_front();
      cycles.push_back(*std::move(delivered));
    }
    if (!cycles.empty() && cycles.back().truth.attained_share() >= options_.enough) {
      result.why =
          absl::StrFormat("%.0f %% of what can be measured is at density", options_.enough * 100);
      for (const Cycle& cycle : cycles) {
        if (absl::Status heard = on_cycle(cycle); !heard.ok()) return heard;
      }
      return result;
    }

    // The plan is the last cycle's; where none came, it is in none.
    Cycle nobody;
    Cycle& cycle = cycles.empty() ? nobody : cycles.back();
    absl::StatusOr<std::optional<Next>> next =
        FindNext(number + 1, !on_their_way.empty(), cycle, result, notes);
    if (!next.ok()) return next.status();
    for (const Cycle& done : cycles) {
      if (absl::Status heard = on_cycle(done); !heard.ok()) return heard;
    }
    if (!next->has_value() && !on_their_way.empty()) {
      // With the data that are still on their way there may be more to do.
      if (absl::Status heard = deliver_all(); !heard.ok()) return heard;
      result.planner_stopped = false;
      next = FindNext(number + 1, false, nobody, result, notes);
      if (!next.ok()) return next.status();
    }
    if (!next->has_value()) return result;
    placement = (*next)->placement;
    promised = (*next)->promised;
    result.why = absl::StrFormat("%d scans were made, as many as asked for", options_.max_scans);
  }
  if (absl::Status heard = deliver_all(); !heard.ok()) return heard;
  return result;
}

}  // namespace vantage::simulated_job
