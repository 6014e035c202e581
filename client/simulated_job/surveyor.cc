#include "client/simulated_job/surveyor.h"

#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/duration.h"
#include "client/library/geometry.h"
#include "client/library/tour_stations.h"

namespace vantage::simulated_job {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kBlockedRadius = 0.3;  // m around a place where nobody can stand
constexpr double kLostRadius = 0.4;     // m around a place whose scan was lost
constexpr int kLargerBudgets = 8;       // plans tried

PlacementErrors ErrorsOf(const JobOptions& options) {
  return {options.seed, options.scanner.positioning_error, options.heading_error, options.tilt,
          options.prior_sigma};
}

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Surveyor::Surveyor(client::Client& client, const Site& site,
                   const simulation::SimulatedScanner& scanner, const JobOptions& options,
                   parallel::Parallel& parallel)
    : client_(client),
      site_(site),
      scanner_(scanner),
      options_(options),
      errors_(ErrorsOf(options)),
      parallel_(parallel) {}

absl::Status Surveyor::Open() {
  v1::CreateSessionRequest request;
  request.set_session_id(options_.session_id);
  v1::Session& session = *request.mutable_session();
  session.set_display_name(absl::StrCat("simulated: ", site_.name));
  v1::ScannerModel& model = *session.add_scanner_models();
  model = client::ToProto(options_.scanner, "simulated");
  model.set_preset(options_.preset);
  model.set_setting(options_.setting);
  session.mutable_planning_config()->set_required_density_per_m2(options_.required_density);
  if (options_.prior_sigma) {
    v1::RegistrationConfig& config = *session.mutable_planning_config()->mutable_registration();
    config.set_prior_position_sigma_m(*options_.prior_sigma);
    config.set_prior_heading_sigma_rad(options_.heading_error);
  }
  const auto created = client_.Call(request);
  if (!created.ok()) return created.status();
  session_ = created->session().name();
  return absl::OkStatus();
}

Placement Surveyor::First() const {
  return FirstPlacement(site_.start, errors_,
                        FirstHeading(scanner_, options_.scanner, site_.start, parallel_));
}

Placement Surveyor::At(const Vector3d& planned, int number, std::optional<double> heading) const {
  return PlacementAt(planned, number, T_scene_world_, errors_, heading);
}

absl::Status Surveyor::Push(const Placement& placement, const std::string& by, MadeScan& made) {
  say_(absl::StrFormat("scan %d: measuring", made.number));
  const sensor::RangeImage image = scanner_.Scan(
      options_.scanner, placement.T_scene_scan, options_.faults,
      options_.seed * 1000 + static_cast<uint64_t>(made.number), parallel_, options_.preview);
  v1::Upload upload;
  upload.set_display_name(absl::StrCat("scan ", made.number));
  upload.set_scanner_model_id("simulated");
  upload.set_scanner(by);
  if (placement.prior) *upload.mutable_prior() = client::ToProto(*placement.prior);
  const auto start = std::chrono::steady_clock::now();
  const auto name = client_.Upload(session_, upload, image, [&](const client::UploadProgress& p) {
    say_(absl::StrFormat("scan %d: sent %.0f %%", made.number,
                         100.0 * static_cast<double>(p.acknowledged_bytes) / p.total_bytes));
  });
  if (!name.ok()) return name.status();
  made.send_seconds = SecondsSince(start);
  say_(absl::StrFormat("scan %d: aligning and merging", made.number));
  auto scan = client_.WaitForScan(*name, [](const v1::Scan&) {});
  if (!scan.ok()) return scan.status();
  made.scan = *std::move(scan);
  made.merged = made.scan.state() == v1::SCAN_STATE_MERGED;
  return absl::OkStatus();
}

// Handles a scan that did not align: measures where the tripod stands.
absl::Status Surveyor::AlignAgain(const Placement& placement, MadeScan& made) {
  made.notes.push_back(
      absl::StrFormat("scan %d %s: %s", made.number,
                      made.scan.state() == v1::SCAN_STATE_DOUBTFUL ? "is doubtful" : "failed",
                      made.scan.state_message()));
  v1::SetScanPoseRequest request;
  request.set_name(made.scan.name());
  *request.mutable_prior() = client::ToProto(MeasuredPrior(placement, made.number, errors_));
  request.set_use(v1::POSE_USE_ALIGN);
  const auto set = client_.Call(request);
  if (!set.ok()) return set.status();
  say_(absl::StrFormat("scan %d: aligning again from a measured pose", made.number));
  auto scan = client_.WaitForScan(made.scan.name(), [](const v1::Scan&) {});
  if (!scan.ok()) return scan.status();
  made.scan = *std::move(scan);
  made.merged = made.scan.state() == v1::SCAN_STATE_MERGED;
  made.second_prior = true;
  return absl::OkStatus();
}

absl::Status Surveyor::GiveUpOn(MadeScan& made) {
  made.notes.push_back(
      absl::StrFormat("scan %d is lost: %s", made.number, made.scan.state_message()));
  v1::WithdrawScanRequest request;
  request.set_name(made.scan.name());
  if (const auto withdrawn = client_.Call(request); !withdrawn.ok()) return withdrawn.status();
  return Reject(made.planned, kLostRadius, "a scan from here did not register");
}

absl::StatusOr<std::string> Surveyor::Announce(const Placement& placement) {
  v1::CreateStationRequest request;
  request.set_parent(session_);
  v1::Station& station = *request.mutable_station();
  *station.mutable_position() = client::ToProto(placement.planned);
  if (!options_.scanner.TurnsAllAround() && placement.prior.has_value()) {
    const Vector3d front = placement.prior->T_world_scan.linear().col(0);
    station.set_heading_rad(std::atan2(front.y(), front.x()));
  }
  const auto created = client_.Call(request);
  if (!created.ok()) return created.status();
  return created->station().name();
}

absl::Status Surveyor::Forget(const std::string& station) {
  v1::DeleteStationRequest request;
  request.set_name(station);
  const absl::Status deleted = client_.Call(request).status();
  return absl::IsNotFound(deleted) ? absl::OkStatus() : deleted;
}

absl::StatusOr<MadeScan> Surveyor::Make(const Placement& placement, int number,
                                        const std::string& by) {
  MadeScan made;
  made.number = number;
  made.planned = placement.planned;
  made.at = placement.T_scene_scan.translation();
  if (!options_.scanner.TurnsAllAround()) {
    const Vector3d front = placement.T_scene_scan.linear().col(0);
    made.facing = std::atan2(front.y(), front.x());
  }
  if (absl::Status pushed = Push(placement, by, made); !pushed.ok()) return pushed;
  Isometry3d T_world_scan = placement.T_world_scan;  // the truth
  if (number == 1) {
    if (!made.merged) {
      return absl::InternalError(
          absl::StrCat("the first scan was not merged: ", made.scan.state_message()));
    }
    T_world_scan = client::FromProto(made.scan.pose());
    T_scene_world_ = placement.T_scene_scan * T_world_scan.inverse();
    made.planned = T_world_scan.translation();
    if (options_.site_prior.has_value()) {
      if (absl::Status sent = SendSitePrior(); !sent.ok()) return sent;
    }
  } else if (!made.merged) {
    if (absl::Status again = AlignAgain(placement, made); !again.ok()) return again;
  }
  made.T_scene_world = T_scene_world_;
  made.planned_in_scene = number == 1 ? site_.start : T_scene_world_ * made.planned;
  if (!made.merged) {
    if (absl::Status given_up = GiveUpOn(made); !given_up.ok()) return given_up;
    return made;
  }
  const Isometry3d off = T_world_scan.inverse() * client::FromProto(made.scan.pose());
  made.off_metres = off.translation().norm();
  stations_.push_back(client::FromProto(made.scan.pose()).translation());
  if (options_.site_prior.has_value()) {
    v1::GetSitePriorRequest request;
    request.set_parent(session_);
    const auto standing = client_.Call(request);
    if (!standing.ok()) return standing.status();
    made.notes.push_back(standing->standing().message());
  }
  return made;
}

absl::Status Surveyor::SendSitePrior() {
  auto request =
      SitePriorRequestOf(site_, *options_.site_prior, T_scene_world_.inverse(), options_.seed);
  if (!request.ok()) return request.status();
  request->set_parent(session_);
  return client_.Call(*std::move(request)).status();
}

absl::Status Surveyor::Reject(const Vector3d& place, double radius, const std::string& reason) {
  v1::RejectViewRequest request;
  request.set_parent(session_);
  *request.mutable_position() = client::ToProto(place);
  request.set_radius_m(radius);
  request.set_reason(reason);
  return client_.Call(request).status();
}

Placement Surveyor::NearestFree(const Placement& placement, int number,
                                const v1::ExpectedStation& expected,
                                std::optional<double> heading) const {
  FreeSpot spot{expected.radius_m(), std::nullopt};
  if (expected.has_doorway()) spot.doorway = client::FromProto(expected.doorway());
  return simulated_job::NearestFree(scanner_, placement, spot, number, T_scene_world_, errors_,
                                    heading);
}

absl::StatusOr<bool> Surveyor::IsBlocked(const Placement& placement) {
  if (CanStand(scanner_, placement)) return false;
  if (absl::Status told = Reject(placement.planned, kBlockedRadius, "blocked"); !told.ok()) {
    return told;
  }
  return true;
}

absl::Status Surveyor::MakeTour() {
  v1::CreateTourRequest request;
  request.set_parent(session_);
  v1::TourWish& wish = *request.mutable_wish();
  *wish.mutable_config_overrides() = options_.plan_overrides;
  *wish.mutable_time_budget() = client::DurationOf(*options_.tour_seconds);
  // A scanner that sees a sector would have to be told which way it looked.
  if (options_.scanner.TurnsAllAround()) {
    for (const v1::Vector3& station : tour_) *wish.add_previous_stations() = station;
  }
  tour_.clear();
  const auto tour = client_.CreateTour(request, [&](const v1::Tour& so_far) {
    say_(absl::StrCat("planning the tour: ", so_far.message()));
  });
  if (absl::IsFailedPrecondition(tour.status())) return absl::OkStatus();  // nowhere to stand
  if (!tour.ok()) return tour.status();
  for (const v1::TourStop& stop : tour->stops()) tour_.push_back(stop.position());
  return absl::OkStatus();
}

absl::StatusOr<PlanMade> Surveyor::Plan(const std::vector<std::string>& scanners,
                                        v1::Ranking ranking, std::optional<uint64_t> work) {
  PlanMade made;
  if (options_.tour_seconds.has_value()) {
    const auto began = std::chrono::steady_clock::now();
    if (absl::Status toured = MakeTour(); !toured.ok()) return toured;
    made.seconds = SecondsSince(began);
  }
  double seconds = options_.plan_seconds;
  if (!work) work = options_.plan_work;
  for (; made.attempts < kLargerBudgets; seconds *= 2) {
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    for (const std::string& scanner : scanners) request.mutable_plan()->add_scanners(scanner);
    request.mutable_plan()->set_ranking(ranking);
    request.mutable_plan()->set_seed(options_.seed);
    client::SetTourStations(tour_, *request.mutable_plan());
    *request.mutable_plan()->mutable_config_overrides() = options_.plan_overrides;
    if (work) {
      request.mutable_plan()->set_work_limit_rays(*work);
      *work *= 2;
    } else {
      *request.mutable_plan()->mutable_time_budget() = client::DurationOf(seconds);
    }
    const auto created = client_.Call(request);
    if (!created.ok()) return created.status();
    auto watched = client_.WatchPlan(created->plan().name(), [&](const v1::Plan& now) {
      say_(absl::StrFormat("planning: gap %.1f %%", now.result().optimality_gap() * 100));
    });
    if (!watched.ok()) return watched.status();
    made.plan = *std::move(watched);
    if (made.plan.state() == v1::PLAN_STATE_FAILED) {
      return absl::InternalError(absl::StrCat("a plan failed: ", made.plan.state_message()));
    }
    ++made.attempts;
    made.budget = work ? 0 : seconds;
    for (const v1::StageDuration& stage : made.plan.result().stage_durations()) {
      made.seconds += client::SecondsOf(stage.duration());
    }
    if (made.plan.result().outcome() != v1::PLAN_OUTCOME_SEARCH_UNFINISHED) break;
  }
  if (options_.full_plans) {
    auto full = client_.GetFullPlan(made.plan.name());
    if (!full.ok()) return full.status();
    made.plan = *std::move(full);
  }
  return made;
}

const v1::RankedView* Surveyor::NearestRefused(const v1::PlanResult& plan) const {
  const v1::RankedView* nearest = nullptr;
  double nearest_distance = 0;
  for (const v1::RankedView& view : plan.refused()) {
    for (const Vector3d& station : stations_) {
      const double distance = (client::FromProto(view.position()) - station).norm();
      if (nearest == nullptr || distance < nearest_distance) {
        nearest = &view;
        nearest_distance = distance;
      }
    }
  }
  return nearest;
}

}  // namespace vantage::simulated_job
