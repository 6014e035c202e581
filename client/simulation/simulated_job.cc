#include "client/simulation/simulated_job.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/geometry.h"
#include "core/simulation/counter_random.h"

namespace vantage {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// What random numbers are for; the index is the scan's number. A normal draw takes two streams.
enum Stream : uint64_t {
  kPlaceX = 100,
  kPlaceY = 102,
  kPlaceZ = 104,
  kYaw = 106,
  kRoll = 108,
  kPitch = 110,
  kHeading = 112,
  kAgain = 114
};

constexpr double kTripodRadius = 0.15;   // m that must really be free to stand
constexpr double kLatticeOfTruth = 0.3;  // m between the places of which the truth is asked
constexpr int kMostRefusals = 5;         // places in a row where nobody can stand
constexpr double kLostRadius = 0.4;      // m around a place whose scan was lost

std::vector<Vector3d> AllowedPositions(const SimulatedScanner& tracer, const Site& site,
                                       const ScannerModel& scanner) {
  std::vector<Vector3d> positions;
  for (const double height : {1.2, 1.8}) {
    Vector3d start = site.start;
    start.z() = site.floor_height + height;
    const std::vector<Vector3d> level =
        StandablePositions(tracer, site.mesh.Bounds(), start, site.floor_height, height,
                           scanner.clearance, kLatticeOfTruth);
    positions.insert(positions.end(), level.begin(), level.end());
  }
  return positions;
}

Isometry3d Upright(const Vector3d& position, double yaw) {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = AngleAxisd(yaw, Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = position;
  return pose;
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

// Where a scan is made and what its maker believes of that.
struct SimulatedJob::Placement {
  Vector3d planned = Vector3d::Zero();               // m, world
  Isometry3d T_scene_scan = Isometry3d::Identity();  // the truth
  Isometry3d T_world_scan = Isometry3d::Identity();  // the truth; not for the first scan
  std::optional<PosePrior> prior;
};

SimulatedJob::SimulatedJob(Client& client, const Site& site, const JobOptions& options,
                           Parallel& parallel)
    : client_(client),
      site_(site),
      options_(options),
      parallel_(parallel),
      scanner_(site.mesh),
      truth_(site.mesh, scanner_, options.scanner, options.required_density,
             AllowedPositions(scanner_, site, options.scanner), options.truth_samples, parallel),
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

SimulatedJob::Placement SimulatedJob::FirstPlacement() const {
  Placement placement;
  placement.T_scene_scan =
      Upright(site_.start, 2 * kPi * RandomUniform(options_.seed, 1, kYaw)) *
      AngleAxisd(options_.tilt * RandomNormal(options_.seed, 1, kRoll), Vector3d::UnitX()) *
      AngleAxisd(options_.tilt * RandomNormal(options_.seed, 1, kPitch), Vector3d::UnitY());
  return placement;
}

SimulatedJob::Placement SimulatedJob::PlacementAt(const Vector3d& planned, int number) const {
  const auto index = static_cast<uint64_t>(number);
  const auto normal = [&](Stream stream) { return RandomNormal(options_.seed, index, stream); };
  const double yaw = 2 * kPi * RandomUniform(options_.seed, index, kYaw);
  const double miss = options_.scanner.positioning_error;
  Placement placement;
  placement.planned = planned;
  placement.T_world_scan =
      Upright(planned + miss * Vector3d(normal(kPlaceX), normal(kPlaceY), normal(kPlaceZ)), yaw) *
      AngleAxisd(options_.tilt * normal(kRoll), Vector3d::UnitX()) *
      AngleAxisd(options_.tilt * normal(kPitch), Vector3d::UnitY());
  placement.T_scene_scan = T_scene_world_ * placement.T_world_scan;
  placement.prior.emplace();
  placement.prior->T_world_scan = Upright(planned, yaw + options_.heading_error * normal(kHeading));
  return placement;
}

bool SimulatedJob::CanStand(const Placement& placement) const {
  const Vector3d at = placement.T_scene_scan.translation();
  return scanner_.Clearance(at, 2 * kTripodRadius) >= kTripodRadius;
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
  const auto index = static_cast<uint64_t>(cycle.number);
  const auto normal = [&](uint64_t i) {
    return RandomNormal(options_.seed, index, kAgain + 2 * i);
  };
  const Eigen::Matrix3d& r = placement.T_world_scan.linear();
  PosePrior prior;
  prior.T_world_scan = Upright(
      placement.T_world_scan.translation() + 0.02 * Vector3d(normal(0), normal(1), normal(2)),
      std::atan2(r(1, 0), r(0, 0)) + Radians(1) * normal(3));
  v1::SetScanPoseRequest request;
  request.set_name(cycle.scan.name());
  *request.mutable_prior() = ToProto(prior);
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
std::optional<Vector3d> SimulatedJob::NextPosition(const v1::Plan& plan, JobResult& result,
                                                   std::vector<std::string>& notes) const {
  const v1::PlanResult& answer = plan.result();
  if (answer.termination().suggested()) {
    result.planner_stopped = true;
    result.why = absl::StrCat("the planner suggests to stop: ", answer.termination().reason());
    return std::nullopt;
  }
  if (answer.outcome() == v1::PLAN_OUTCOME_VIEWS) return FromProto(answer.views(0).position());
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
  return FromProto(nearest->position());
}

absl::StatusOr<JobResult> SimulatedJob::Run(
    absl::FunctionRef<absl::Status(const Cycle&)> on_cycle) {
  if (absl::Status opened = Open(); !opened.ok()) return opened;
  JobResult result;
  result.session = session_;
  Placement placement = FirstPlacement();
  std::vector<std::string> notes;
  for (int number = 1; number <= options_.max_scans; ++number) {
    auto made = MakeScan(placement, number);
    if (!made.ok()) return made.status();
    Cycle cycle = *std::move(made);
    ++result.made;
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

    std::optional<Vector3d> next;
    for (int refusals = 0; refusals <= kMostRefusals; ++refusals) {
      auto plan = PlanNext();
      if (!plan.ok()) return plan.status();
      cycle.plan = *std::move(plan);
      next = NextPosition(cycle.plan, result, notes);
      if (!next) break;
      placement = PlacementAt(*next, number + 1);
      if (CanStand(placement)) break;
      cycle.notes.push_back(absl::StrFormat("nobody can stand at (%.2f, %.2f, %.2f)", next->x(),
                                            next->y(), next->z()));
      if (absl::Status refused = Reject(*next, 0.3, "blocked"); !refused.ok()) return refused;
      next.reset();
      result.why = "the planner's views cannot be stood at";
    }
    if (absl::Status heard = on_cycle(cycle); !heard.ok()) return heard;
    if (!next) return result;
    result.why = absl::StrFormat("%d scans were made, as many as asked for", options_.max_scans);
  }
  return result;
}

}  // namespace vantage
