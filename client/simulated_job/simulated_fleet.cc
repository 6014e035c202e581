#include "client/simulated_job/simulated_fleet.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <limits>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/duration.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "client/simulated_job/attainable.h"

namespace vantage::simulated_job {
namespace {

using Eigen::Vector3d;

constexpr int kMostRefusals = 5;                 // places in a row where nobody can stand
constexpr int64_t kClaimSeconds = 24 * 60 * 60;  // simulated time passes faster than the server's
constexpr int kLooks = 8;  // checks whether a claim has ended with its scan, 20 ms and more apart
constexpr double kNever = std::numeric_limits<double>::infinity();

size_t Count(const simulation::SampleSet& set) {
  size_t count = 0;
  for (const uint64_t word : set) count += static_cast<size_t>(std::popcount(word));
  return count;
}

double Length(const std::vector<Eigen::Vector2d>& way) {
  double length = 0;
  for (size_t i = 1; i < way.size(); ++i) length += (way[i] - way[i - 1]).norm();
  return length;
}

}  // namespace

std::string SimulatedFleet::ScannerId(int scanner) { return absl::StrCat("scanner-", scanner + 1); }

SimulatedFleet::SimulatedFleet(client::Client& client, const Site& site,
                               const FleetOptions& options, parallel::Parallel& parallel)
    : client_(client),
      site_(site),
      options_(options),
      parallel_(parallel),
      scanner_(site.mesh),
      walks_(scanner_, site),
      truth_(site.mesh, scanner_, options.job.scanner, options.job.required_density,
             AllowedPositions(scanner_, site, options.job.scanner), options.job.truth_samples,
             parallel),
      surveyor_(client, site, scanner_, options.job, parallel) {
  members_.resize(static_cast<size_t>(options.scanners));
  for (Member& member : members_) member.at = site.start;
}

SimulatedFleet::~SimulatedFleet() = default;

absl::Status SimulatedFleet::Open() {
  absl::Status can = CheckAttainable(truth_.Measure(), site_, options_.job.required_density);
  if (!can.ok()) return can;
  if (absl::Status opened = surveyor_.Open(); !opened.ok()) return opened;
  result_.session = surveyor_.session();
  for (size_t i = 0; i < members_.size(); ++i) {
    v1::CreateScannerRequest request;
    request.set_parent(surveyor_.session());
    request.set_scanner_id(ScannerId(static_cast<int>(i)));
    request.mutable_scanner()->set_speed_m_per_s(options_.speed);
    *request.mutable_scanner()->mutable_scan_duration() = client::DurationOf(options_.scan_seconds);
    const auto added = client_.Call(request);
    if (!added.ok()) return added.status();
    members_[i].name = added->scanner().name();
  }
  return absl::OkStatus();
}

bool SimulatedFleet::SomebodyIsOut() const {
  return std::any_of(members_.begin(), members_.end(),
                     [](const Member& member) { return member.errand.has_value(); });
}

// Sends the scanner out, which has looked for a free spot for so many minutes before. A scan that
// would not register without others' scans is made when those are in.
void SimulatedFleet::SetOut(Member& member, const Placement& placement, const Goal& goal,
                            double searched) {
  Errand errand;
  errand.placement = placement;
  errand.number = ++set_out_;
  errand.claim = goal.claim;
  const Vector3d to = placement.T_scene_scan.translation();
  errand.stop.scanner = static_cast<int>(&member - members_.data());
  errand.stop.way = walks_.Way(member.at, to);
  errand.stop.walked = Length(errand.stop.way);
  if (goal.area > 0) errand.stop.expected_gain = goal.area;
  const double there = now_ + searched + errand.stop.walked / options_.speed / 60;
  double ready = there;
  for (const Member& other : members_) {
    if (other.errand && std::count(goal.after.begin(), goal.after.end(), other.errand->claim) > 0) {
      ready = std::max(ready, other.errand->done);
    }
  }
  errand.stop.waited = ready - there;
  errand.done = ready + options_.scan_seconds / 60;
  member.errand = std::move(errand);
}

// The claim of a scan that is in ends by itself shortly after; one that does not is released.
absl::Status SimulatedFleet::EndClaim(const std::string& claim, bool arrived) {
  for (int look = 0; arrived && look < kLooks; ++look) {
    v1::ListClaimsRequest list;
    list.set_parent(surveyor_.session());
    list.set_page_size(1000);
    const auto held = client_.Call(list);
    if (!held.ok()) return held.status();
    if (std::none_of(held->claims().begin(), held->claims().end(),
                     [&](const v1::Claim& other) { return other.name() == claim; })) {
      return absl::OkStatus();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20 << look));
  }
  v1::ReleaseClaimRequest release;
  release.set_name(claim);
  const absl::Status released = client_.Call(release).status();
  return absl::IsFailedPrecondition(released) ? absl::OkStatus() : released;
}

absl::StatusOr<FleetStop> SimulatedFleet::Finish(Member& member) {
  const Errand errand = *std::exchange(member.errand, std::nullopt);
  now_ = errand.done;
  FleetStop stop = errand.stop;
  member.at = errand.placement.T_scene_scan.translation();
  member.free_since = now_;
  auto made = surveyor_.Make(errand.placement, errand.number, member.name);
  if (!made.ok()) return made.status();
  stop.made = *std::move(made);
  if (!errand.claim.empty()) {
    if (absl::Status ended = EndClaim(errand.claim, stop.made.merged); !ended.ok()) return ended;
  }
  stop.order = ++result_.made;
  stop.minutes = now_;
  if (stop.made.merged) {
    measured_ += Count(truth_.MeasuredAtDensity({stop.made.at}, parallel_)[0]);
    truth_.AddScan(stop.made.at, parallel_);
  } else {
    ++result_.lost;
  }
  stop.truth = truth_.Measure();
  result_.minutes = now_;
  result_.attained = stop.truth.attained_share();
  if (measured_ > 0) {
    result_.waste =
        1 - static_cast<double>(Count(truth_.AtDensity())) / static_cast<double>(measured_);
  }
  return stop;
}

// False when another scanner has claimed the view.
absl::StatusOr<bool> SimulatedFleet::Claim(const Member& member, const v1::Plan& plan, Goal& goal) {
  v1::ClaimViewRequest request;
  request.set_parent(surveyor_.session());
  request.set_scanner(member.name);
  *request.mutable_position() = client::ToProto(goal.position);
  request.set_plan(plan.name());
  request.mutable_ttl()->set_seconds(kClaimSeconds);
  const auto claimed = client_.Call(request);
  if (claimed.ok()) {
    goal.claim = claimed->claim().name();
    return true;
  }
  if (client::Explain(claimed.status()).reason != "CLAIMED") return claimed.status();
  ++result_.claims_refused;
  return false;
}

// The best view of a plan that nobody else has claimed. Nothing, with the reason, when there is
// none now.
absl::StatusOr<std::optional<SimulatedFleet::Goal>> SimulatedFleet::ChooseGoal(
    const Member& member) {
  const auto plan = surveyor_.Plan({member.name}, v1::RANKING_SCORE_PER_MINUTE);
  if (!plan.ok()) return plan.status();
  const v1::PlanResult& answer = plan->plan.result();
  std::vector<const v1::RankedView*> views;
  if (answer.termination().suggested()) {
    result_.why = absl::StrCat("the planner suggests to stop: ", answer.termination().message());
    return std::nullopt;
  }
  if (answer.outcome() == v1::PLAN_OUTCOME_VIEWS) {
    for (const v1::RankedView& view : answer.views()) views.push_back(&view);
  } else if (const v1::RankedView* refused = surveyor_.NearestRefused(answer);
             refused != nullptr && !SomebodyIsOut()) {
    views.push_back(refused);  // no pending scan will make another view register
  }
  result_.why = absl::StrCat("the planner has no view to offer: ", answer.message());
  for (const v1::RankedView* view : views) {
    Goal goal{client::FromProto(view->position()), view->expected_gain_m2(), "", {}, {}};
    if (view->has_expected_station()) goal.expected = view->expected_station();
    for (const v1::Assignment& assignment : answer.joint().assignments()) {
      if (assignment.has_view_index() && &answer.views(assignment.view_index()) == view) {
        goal.after.assign(assignment.waits_for_claims().begin(),
                          assignment.waits_for_claims().end());
      }
    }
    if (!options_.claims) return goal;
    const auto mine = Claim(member, plan->plan, goal);
    if (!mine.ok()) return mine.status();
    if (*mine) return goal;
    result_.why = "every view that the planner offers is claimed";
  }
  return std::nullopt;
}

absl::Status SimulatedFleet::SendOut(Member& member) {
  double searched = 0;  // min
  for (int refusals = 0; refusals <= kMostRefusals; ++refusals) {
    auto goal = ChooseGoal(member);
    if (!goal.ok()) return goal.status();
    if (!goal->has_value()) return absl::OkStatus();
    Placement placement = surveyor_.At((*goal)->position, set_out_ + 1);
    if ((*goal)->expected.has_value()) {
      placement = surveyor_.NearestFree(placement, set_out_ + 1, *(*goal)->expected, std::nullopt);
    }
    const auto blocked = surveyor_.IsBlocked(placement);
    if (!blocked.ok()) return blocked.status();
    if (!*blocked) {
      SetOut(member, placement, **goal, searched);
      return absl::OkStatus();
    }
    if ((*goal)->expected.has_value()) searched += kNoFreeSpotMinutes;
    if (!(*goal)->claim.empty()) {
      if (absl::Status ended = EndClaim((*goal)->claim, false); !ended.ok()) return ended;
    }
    result_.why = "the planner's views cannot be stood at";
  }
  return absl::OkStatus();
}

// The scanner that has waited longest goes first.
absl::Status SimulatedFleet::SendOutIdle() {
  std::vector<Member*> idle;
  for (Member& member : members_) {
    if (!member.errand) idle.push_back(&member);
  }
  std::stable_sort(idle.begin(), idle.end(),
                   [](const Member* a, const Member* b) { return a->free_since < b->free_since; });
  for (Member* member : idle) {
    if (set_out_ >= options_.job.max_scans) break;
    if (absl::Status sent = SendOut(*member); !sent.ok()) return sent;
  }
  return absl::OkStatus();
}

absl::StatusOr<FleetResult> SimulatedFleet::Run(
    absl::FunctionRef<absl::Status(const FleetStop&)> on_stop) {
  if (absl::Status opened = Open(); !opened.ok()) return opened;
  // All scanners wait for the first scan, since without it there is nothing to plan on.
  SetOut(members_[0], surveyor_.First(), Goal{}, 0);
  while (true) {
    const auto next =
        std::min_element(members_.begin(), members_.end(), [](const Member& a, const Member& b) {
          return (a.errand ? a.errand->done : kNever) < (b.errand ? b.errand->done : kNever);
        });
    if (!next->errand) break;  // no scanner has a next place
    const auto stop = Finish(*next);
    if (!stop.ok()) return stop.status();
    if (absl::Status heard = on_stop(*stop); !heard.ok()) return heard;
    if (result_.attained >= options_.target) {
      result_.target_minutes = now_;
      result_.why =
          absl::StrFormat("%.0f %% of what can be measured is at density", options_.target * 100);
      break;
    }
    if (result_.made >= options_.job.max_scans) {
      result_.why = absl::StrFormat("%d scans were made, as many as asked for", result_.made);
      break;
    }
    if (absl::Status sent = SendOutIdle(); !sent.ok()) return sent;
  }
  return result_;
}

}  // namespace vantage::simulated_job
