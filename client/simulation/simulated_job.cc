#include "client/simulation/simulated_job.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/geometry.h"

namespace vantage {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr int kMostRefusals = 5;     // places in a row where nobody can stand
constexpr double kLostRadius = 0.4;  // m around a place whose scan was lost

PlacementErrors ErrorsOf(const JobOptions& options) {
  return {options.seed, options.scanner.positioning_error, options.heading_error, options.tilt};
}

const v1::RankedView* FirstWithOverlap(
    const google::protobuf::RepeatedPtrField<v1::RankedView>& views, double overlap) {
  for (const v1::RankedView& view : views) {
    if (view.verdict().overlap_share() >= overlap) return &view;
  }
  return nullptr;
}

// The best view by the rule; null when there is none. Both lists are sorted, the best first.
const v1::RankedView* Choose(const v1::PlanResult& plan, ViewChoice choice) {
  if (choice == ViewChoice::kRegistrable) {
    return plan.outcome() == v1::PLAN_OUTCOME_VIEWS ? &plan.views(0) : nullptr;
  }
  const double overlap =
      choice == ViewChoice::kOverlap ? plan.config().registration().minimum_overlap() : 0;
  const v1::RankedView* passed = FirstWithOverlap(plan.views(), overlap);
  const v1::RankedView* refused = FirstWithOverlap(plan.refused(), overlap);
  if (passed == nullptr || refused == nullptr) return passed != nullptr ? passed : refused;
  return refused->score() > passed->score() ? refused : passed;
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

SimulatedJob::SimulatedJob(Client& client, const Site& site, const JobOptions& options,
                           Parallel& parallel)
    : SimulatedJob(client, site, options, std::make_unique<SimulatedScanner>(site.mesh), parallel) {
}

SimulatedJob::SimulatedJob(Client& client, const Site& site, const JobOptions& options,
                           std::unique_ptr<const SimulatedScanner> scanner, Parallel& parallel)
    : SimulatedJob(client, site, options, *scanner,
                   GroundTruth(site.mesh, *scanner, options.scanner, options.required_density,
                               AllowedPositions(*scanner, site, options.scanner),
                               options.truth_samples, parallel),
                   parallel) {
  own_scanner_ = std::move(scanner);
}

SimulatedJob::SimulatedJob(Client& client, const Site& site, const JobOptions& options,
                           const SimulatedScanner& scanner, const GroundTruth& truth,
                           Parallel& parallel)
    : client_(client),
      site_(site),
      options_(options),
      errors_(ErrorsOf(options)),
      parallel_(parallel),
      scanner_(scanner),
      truth_(truth),
      plan_seconds_(options.plan_seconds) {}

SimulatedJob::~SimulatedJob() = default;

absl::Status SimulatedJob::Open() {
  v1::CreateSessionRequest request;
  request.set_session_id(options_.session_id);
  v1::Session& session = *request.mutable_session();
  session.set_display_name(absl::StrCat("simulated: ", site_.name));
  *session.add_scanner_models() = ToProto(options_.scanner, "simulated");
  session.mutable_planning_config()->set_required_density(options_.required_density);
  const auto created = client_.Call(request);
  if (!created.ok()) return created.status();
  session_ = created->session().name();
  return absl::OkStatus();
}

absl::StatusOr<Cycle> SimulatedJob::MakeScan(const Placement& placement, int number) {
  Cycle cycle;
  cycle.number = number;
  cycle.planned = placement.planned;
  say_(absl::StrFormat("scan %d: measuring", number));
  const RangeImage image =
      scanner_.Scan(options_.scanner, placement.T_scene_scan, options_.faults,
                    options_.seed * 1000 + static_cast<uint64_t>(number), parallel_);
  v1::Upload upload;
  upload.set_display_name(absl::StrCat("scan ", number));
  upload.set_scanner_model_id("simulated");
  if (placement.prior) *upload.mutable_prior() = ToProto(*placement.prior);
  const auto start = std::chrono::steady_clock::now();
  const auto name = client_.Upload(session_, upload, image, [&](const UploadProgress& p) {
    say_(absl::StrFormat("scan %d: sent %.0f %%", number,
                         100.0 * static_cast<double>(p.acknowledged_bytes) / p.total_bytes));
  });
  if (!name.ok()) return name.status();
  cycle.send_seconds = SecondsSince(start);
  say_(absl::StrFormat("scan %d: aligning and merging", number));
  auto scan = client_.WaitForScan(*name, [](const v1::Scan&) {});
  if (!scan.ok()) return scan.status();
  cycle.scan = *std::move(scan);
  cycle.merged = cycle.scan.state() == v1::SCAN_STATE_MERGED;
  return cycle;
}

// What a surveyor does about a scan that did not align: measures where the tripod stands.
absl::Status SimulatedJob::AlignAgain(const Placement& placement, Cycle& cycle) {
  cycle.notes.push_back(
      absl::StrFormat("scan %d %s: %s", cycle.number,
                      cycle.scan.state() == v1::SCAN_STATE_DOUBTFUL ? "is doubtful" : "failed",
                      cycle.scan.state_message()));
  v1::SetScanPoseRequest request;
  request.set_name(cycle.scan.name());
  *request.mutable_prior() = ToProto(MeasuredPrior(placement, cycle.number, errors_));
  request.set_use(v1::POSE_USE_ALIGN);
  const auto set = client_.Call(request);
  if (!set.ok()) return set.status();
  say_(absl::StrFormat("scan %d: aligning again from a measured pose", cycle.number));
  auto scan = client_.WaitForScan(cycle.scan.name(), [](const v1::Scan&) {});
  if (!scan.ok()) return scan.status();
  cycle.scan = *std::move(scan);
  cycle.merged = cycle.scan.state() == v1::SCAN_STATE_MERGED;
  cycle.second_prior = true;
  return absl::OkStatus();
}

absl::Status SimulatedJob::Reject(const Vector3d& place, double radius, const std::string& reason) {
  v1::RejectViewRequest request;
  request.set_parent(session_);
  *request.mutable_position() = ToProto(place);
  request.set_radius(radius);
  request.set_reason(reason);
  return client_.Call(request).status();
}

absl::Status SimulatedJob::GiveUpOn(Cycle& cycle) {
  cycle.notes.push_back(
      absl::StrFormat("scan %d is lost: %s", cycle.number, cycle.scan.state_message()));
  v1::WithdrawScanRequest request;
  request.set_name(cycle.scan.name());
  if (const auto withdrawn = client_.Call(request); !withdrawn.ok()) return withdrawn.status();
  return Reject(cycle.planned, kLostRadius, "a scan from here did not register");
}

absl::StatusOr<v1::Plan> SimulatedJob::PlanNext() {
  v1::Plan plan;
  for (int attempt = 0; attempt < 4; ++attempt) {
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    request.mutable_plan()->set_seed(options_.seed);
    *request.mutable_plan()->mutable_config_overrides() = options_.plan_overrides;
    if (options_.plan_work) {
      request.mutable_plan()->set_work_limit(*options_.plan_work);
    } else {
      const double whole = std::floor(plan_seconds_);
      request.mutable_plan()->mutable_time_budget()->set_seconds(static_cast<int64_t>(whole));
      request.mutable_plan()->mutable_time_budget()->set_nanos(
          static_cast<int32_t>((plan_seconds_ - whole) * 1e9));
    }
    const auto created = client_.Call(request);
    if (!created.ok()) return created.status();
    auto watched = client_.WatchPlan(created->plan().name(), [&](const v1::Plan& now) {
      say_(absl::StrFormat("planning: gap %.1f %%", now.result().optimality_gap() * 100));
    });
    if (!watched.ok()) return watched.status();
    plan = *std::move(watched);
    if (plan.state() == v1::PLAN_STATE_FAILED) {
      return absl::InternalError(absl::StrCat("a plan failed: ", plan.state_message()));
    }
    if (plan.result().outcome() != v1::PLAN_OUTCOME_BUDGET_TOO_SMALL) break;
    plan_seconds_ *= 2;
    if (options_.plan_work) *options_.plan_work *= 2;
  }
  if (!options_.full_plans) return plan;
  return client_.GetFullPlan(plan.name());
}

// Where to go after a plan; nothing, and why, when the job ends with it.
std::optional<SimulatedJob::Next> SimulatedJob::NextPosition(const v1::Plan& plan,
                                                             JobResult& result,
                                                             std::vector<std::string>& notes) {
  const v1::PlanResult& answer = plan.result();
  if (answer.termination().suggested()) {
    if (!result.planner_stopped) result.stop_suggested_after = result.made;
    result.planner_stopped = true;
    result.why = absl::StrCat("the planner suggests to stop: ", answer.termination().reason());
    if (options_.heed_termination) return std::nullopt;
  }
  if (const v1::RankedView* chosen = Choose(answer, options_.choice); chosen != nullptr) {
    return Next{FromProto(chosen->position()), chosen->area()};
  }
  if (answer.outcome() != v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW || answer.refused().empty()) {
    result.why = absl::StrCat("the planner has no view to offer: ", answer.message());
    return std::nullopt;
  }
  // The remedy is to stay nearer to what is there: the refused view nearest to a stand.
  const v1::RankedView* nearest = nullptr;
  double nearest_distance = 0;
  for (const v1::RankedView& view : answer.refused()) {
    for (const Vector3d& stand : stands_) {
      const double distance = (FromProto(view.position()) - stand).norm();
      if (nearest == nullptr || distance < nearest_distance) {
        nearest = &view;
        nearest_distance = distance;
      }
    }
  }
  if (nearest == nullptr) {
    result.why = absl::StrCat("no view will register: ", answer.message());
    return std::nullopt;
  }
  notes.push_back(
      absl::StrCat("no view is sure to register; taking the nearest refused one, "
                   "whose remedy is: ",
                   nearest->verdict().remedy()));
  return Next{FromProto(nearest->position()), nearest->area()};
}

absl::StatusOr<JobResult> SimulatedJob::Run(
    absl::FunctionRef<absl::Status(const Cycle&)> on_cycle) {
  if (absl::Status opened = Open(); !opened.ok()) return opened;
  JobResult result;
  result.session = session_;
  std::optional<double> predicted;
  Placement placement = FirstPlacement(site_.start, errors_);
  std::vector<std::string> notes;
  for (int number = 1; number <= options_.max_scans; ++number) {
    auto made = MakeScan(placement, number);
    if (!made.ok()) return made.status();
    Cycle cycle = *std::move(made);
    ++result.made;
    cycle.predicted_area = predicted;
    cycle.at = placement.T_scene_scan.translation();
    std::swap(cycle.notes, notes);
    if (number == 1) {
      if (!cycle.merged) {
        return absl::InternalError(
            absl::StrCat("the first scan was not merged: ", cycle.scan.state_message()));
      }
      T_scene_world_ = placement.T_scene_scan * FromProto(cycle.scan.pose()).inverse();
      placement.T_world_scan = FromProto(cycle.scan.pose());
      cycle.planned = placement.T_world_scan.translation();
    } else if (!cycle.merged) {
      if (absl::Status again = AlignAgain(placement, cycle); !again.ok()) return again;
    }
    if (cycle.merged) {
      const Isometry3d off = placement.T_world_scan.inverse() * FromProto(cycle.scan.pose());
      cycle.off_metres = off.translation().norm();
      cycle.off_degrees = Degrees(AngleAxisd(off.linear()).angle());
      stands_.push_back(FromProto(cycle.scan.pose()).translation());
      truth_.AddScan(placement.T_scene_scan.translation(), parallel_);
    } else {
      ++result.lost;
      if (absl::Status given_up = GiveUpOn(cycle); !given_up.ok()) return given_up;
    }
    cycle.truth = truth_.Measure();
    cycle.T_scene_world = T_scene_world_;
    cycle.planned_in_scene = number == 1 ? site_.start : T_scene_world_ * placement.planned;
    if (cycle.truth.attained_share() >= options_.enough) {
      if (absl::Status heard = on_cycle(cycle); !heard.ok()) return heard;
      result.why =
          absl::StrFormat("%.0f %% of what can be measured is at density", options_.enough * 100);
      return result;
    }

    std::optional<Next> next;
    for (int refusals = 0; refusals <= kMostRefusals; ++refusals) {
      auto plan = PlanNext();
      if (!plan.ok()) return plan.status();
      cycle.plan = *std::move(plan);
      next = NextPosition(cycle.plan, result, notes);
      if (!next) break;
      placement = PlacementAt(next->position, number + 1, T_scene_world_, errors_);
      if (CanStand(scanner_, placement)) break;
      cycle.notes.push_back(absl::StrFormat("nobody can stand at (%.2f, %.2f, %.2f)",
                                            next->position.x(), next->position.y(),
                                            next->position.z()));
      if (absl::Status refused = Reject(next->position, 0.3, "blocked"); !refused.ok())
        return refused;
      next.reset();
      result.why = "the planner's views cannot be stood at";
    }
    if (absl::Status heard = on_cycle(cycle); !heard.ok()) return heard;
    if (!next) return result;
    predicted = next->area;
    result.why = absl::StrFormat("%d scans were made, as many as asked for", options_.max_scans);
  }
  return result;
}

}  // namespace vantage
