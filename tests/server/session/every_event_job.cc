#include "tests/server/session/every_event_job.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/parallel/parallel.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "server/conversion/to_proto.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

constexpr size_t kPieceBytes = 5000;
const Eigen::Vector3d kOrigin(1000, 2000, 10);

v1::Vector3 World(const Eigen::Vector3d& position) {
  v1::Vector3 out;
  out.set_x(position.x() + kOrigin.x());
  out.set_y(position.y() + kOrigin.y());
  out.set_z(position.z() + kOrigin.z());
  return out;
}

class Job {
 public:
  explicit Job(store::Store& store) : scene_(simulation::TwoRooms(1)), tracer_(scene_.mesh) {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(4);
    Algorithms algorithms = Algorithms::Core();
    algorithms.register_scan =
        [this, align = algorithms.register_scan](
            const model::PlanningView& model, const sensor::Scan& scan,
            const Eigen::Isometry3d& last_pose, std::span<const registration::TargetTie> targets,
            const registration::RegistrationConfig& config, parallel::Parallel& parallel) {
          auto result = align(model, scan, last_pose, targets, config, parallel);
          if (result.ok() && verdict_.has_value()) {
            result->verdict.outcome = *verdict_;
            const bool good = *verdict_ == registration::RegistrationOutcome::kRegistered;
            result->verdict.reason = good ? "" : "as the job wants it";
            result->verdict.remedy = good ? "" : "set its pose";
          }
          return result;
        };
    // The verdicts are this job's own, whatever comes later.
    algorithms.try_doubts_again = false;
    contract::Limits limits;
    limits.snapshots_per_session = 0;
    limits.keep_withdrawn_scans = absl::Hours(2);
    host_ = std::make_unique<fixture::SessionHost>(store, std::move(algorithms), limits, [this] {
      return fixture::FixtureTime() + absl::Seconds(seconds_.load());
    });
  }

  void Run() {
    Open();
    CreateScanner("red", "fine", 0.8, 120);
    CreateScanner("blue", "coarse", 1.2, 90);
    const Eigen::Vector3d start = scene_.starts[0];

    // The first scan, and where to go from there.
    Pass(60);
    Send(start, "first", nullptr, Scanner("red"));
    const std::string plan = Plan("plan-1", {}, false);
    const v1::Plan made = session_->plans().Get(plan).value();
    ASSERT_GT(made.result().views_size(), 1) << made.result().message();
    v1::RejectViewRequest reject;
    *reject.mutable_position() = World({50, 50, 0});
    reject.set_radius_m(0.75);
    reject.set_reason("a cupboard");
    reject.mutable_ttl()->set_seconds(864'000);
    reject.set_request_id("reject-1");
    v1::Rejection wanted;
    *wanted.mutable_position() = reject.position();
    wanted.set_radius_m(reject.radius_m());
    wanted.set_reason(reject.reason());
    ASSERT_TRUE(session_->rejections()
                    .Create(wanted, absl::Seconds(reject.ttl().seconds()),
                            RequestKey::Of(reject.request_id(), "RejectView", reject))
                    .ok());

    // A claim that is fulfilled, one that is released, one that lapses.
    const v1::Claim first = Claim("red", made.result().views(0).position(), plan);
    Pass(10);
    v1::RenewClaimRequest renew;
    renew.set_name(first.name());
    renew.mutable_ttl()->set_seconds(1800);
    renew.set_request_id("renew-1");
    ASSERT_TRUE(session_->claims()
                    .Renew(renew.name(), absl::Seconds(1800),
                           RequestKey::Of(renew.request_id(), "RenewClaim", renew))
                    .ok());
    Plan("plan-2", {Scanner("red"), Scanner("blue")}, true);
    const Eigen::Vector3d claimed =
        Eigen::Vector3d(first.position().x(), first.position().y(), first.position().z()) - kOrigin;
    verdict_ = registration::RegistrationOutcome::kRegistered;
    const v1::PosePrior near = Prior(claimed + Eigen::Vector3d(0.06, -0.04, 0.01), 1);
    Send(claimed, "second", &near, Scanner("red"));
    const v1::Claim second = Claim("blue", World(scene_.starts[1]), "");
    v1::ReleaseClaimRequest release;
    release.set_name(second.name());
    release.set_request_id("release-1");
    ASSERT_TRUE(
        session_->claims()
            .Release(release.name(), RequestKey::Of(release.request_id(), "ReleaseClaim", release))
            .ok());
    Claim("blue", World(scene_.starts[1]), "");
    Pass(3600);
    session_->claims().Expire();

    // Scans that a person decides on, one by targets and one that is believed.
    verdict_ = registration::RegistrationOutcome::kDoubtful;
    const Eigen::Vector3d beside = start + Eigen::Vector3d(0.4, 0.2, 0);
    const v1::PosePrior prior = Prior(beside, 2);
    v1::AcceptScanRequest accept;
    accept.set_name(Send(beside, "doubtful", &prior, Scanner("blue")));
    accept.set_request_id("accept-1");
    ASSERT_TRUE(
        session_->scans()
            .Accept(accept.name(), {}, RequestKey::Of(accept.request_id(), "AcceptScan", accept))
            .ok());
    Rest();
    verdict_ = registration::RegistrationOutcome::kFailed;
    v1::SetScanPoseRequest set;
    set.set_name(Send(start, "failed", &prior, ""));
    *set.mutable_prior() = Prior(start, 0);
    set.set_use(v1::POSE_USE_AS_IS);
    set.set_request_id("set-1");
    ASSERT_TRUE(session_->scans()
                    .SetPose(set.name(), set.prior(), true,
                             RequestKey::Of(set.request_id(), "SetScanPose", set))
                    .ok());
    Rest();
    verdict_.reset();
    v1::PosePrior trusted = Prior(beside, 0);
    for (int i = 0; i < 36; ++i) trusted.add_covariance(i % 7 == 0 ? 1e-6 : 0);
    trusted.set_levelled_sigma_rad(0.002);
    trusted.set_trusted(true);
    std::vector<v1::TargetSighting> targets(3);
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d at(i == 0 ? 1 : 0, i == 1 ? 1.5 : -0.5, 0.1 * i);
      targets[i].set_name(absl::StrCat("target-", i));
      targets[i].mutable_in_scan()->set_x(at.x());
      targets[i].mutable_in_scan()->set_y(at.y());
      targets[i].mutable_in_scan()->set_z(at.z());
      *targets[i].mutable_in_world() = World(beside + at);
      targets[i].set_sigma_m(0.003);
    }
    Send(beside, "trusted", &trusted, Scanner("blue"), targets);

    // One goes again, and its data with it.
    v1::WithdrawScanRequest withdraw;
    withdraw.set_name("sessions/job/scans/scan-2");
    withdraw.set_request_id("withdraw-1");
    ASSERT_TRUE(session_->scans()
                    .Withdraw(withdraw.name(),
                              RequestKey::Of(withdraw.request_id(), "WithdrawScan", withdraw))
                    .ok());
    Rest();
    Pass(3 * 3600);
    host_->registry.Collect();

    // A plan that ends when it is told to, one that refuses views, and uploads that come to
    // nothing.
    Cancelled();
    Plan("plan-4", {}, false, 0.6);
    SendDamaged();
    v1::CreateUploadRequest abandoned;
    abandoned.set_request_id("abandoned");
    ASSERT_TRUE(session_->uploads().Create(abandoned).ok());
    Pass(25 * 3600);
    session_->uploads().Expire();

    // A claim that another's plan goes around, and what is still under way.
    Claim("red", World(start + Eigen::Vector3d(0, 0.1, 0)), "", 86'400);
    Plan("plan-5", {Scanner("blue")}, false);
    LeaveUpload();
    Rest();
  }

 private:
  static std::string Scanner(const std::string& id) {
    return absl::StrCat("sessions/job/scanners/", id);
  }
  void Pass(int seconds) { seconds_ += seconds; }
  void Rest() { session_->WaitUntilIdle(); }

  void Open() {
    v1::CreateSessionRequest create;
    create.set_session_id("job");
    create.set_request_id("open");
    v1::Session& session = *create.mutable_session();
    session.set_display_name("two rooms");
    for (const char* id : {"fine", "coarse"}) {
      v1::ScannerModel& model = *session.add_scanner_models();
      model.set_id(id);
      model.set_azimuth_step_rad(id[0] == 'f' ? sensor::Radians(4) : sensor::Radians(5));
      model.set_elevation_step_rad(id[0] == 'f' ? sensor::Radians(4) : sensor::Radians(5));
      model.set_max_range_m(15);
    }
    session.mutable_model_config()->set_voxel_size_m(0.2);
    session.mutable_planning_config()->set_required_density_per_m2(12);
    session.mutable_planning_config()->set_viewcell_size_m(0.4);
    session.mutable_planning_config()->set_require_reachable(false);
    session.mutable_planning_config()->set_max_view_count(3);
    session.mutable_planning_config()->mutable_registration()->set_required_accuracy_m(0.1);
    session.mutable_planning_config()->mutable_registration()->set_sample_spacing_m(0.1);
    *session.mutable_origin() = World(Eigen::Vector3d::Zero());
    session_ = host_->registry.Create(create, "office").value();

    v1::UpdateSessionRequest update;
    update.set_request_id("update");
    v1::Session& changed = *update.mutable_session();
    changed.set_name("sessions/job");
    changed.set_display_name("two rooms and a door");
    v1::Box& box = *changed.mutable_site_rules()->add_keep_out();
    *box.mutable_min() = World({-5, -5, 0});
    *box.mutable_max() = World({-4, -4, 3});
    v1::Box& region = *changed.mutable_site_rules()->mutable_region_of_interest();
    *region.mutable_min() = World({-1, -1, -1});
    *region.mutable_max() = World({20, 20, 4});
    update.mutable_update_mask()->add_paths("display_name");
    update.mutable_update_mask()->add_paths("site_rules");
    const auto updated = session_->Update(update);
    ASSERT_TRUE(updated.ok()) << updated.status();
  }

  void CreateScanner(const std::string& id, const std::string& model, double speed,
                     double seconds) {
    v1::CreateScannerRequest request;
    request.set_scanner_id(id);
    request.set_request_id("add-" + id);
    v1::Scanner& scanner = *request.mutable_scanner();
    scanner.set_display_name("the " + id + " one");
    scanner.set_scanner_model_id(model);
    scanner.set_operator_("somebody");
    scanner.set_speed_m_per_s(speed);
    *scanner.mutable_scan_duration() = conversion::WriteDuration(seconds);
    *scanner.add_reach()->mutable_min() = World({-1, -1, -1});
    *scanner.mutable_reach(0)->mutable_max() = World({20, 20, 4});
    const auto added = session_->scanners().Create(request);
    ASSERT_TRUE(added.ok()) << added.status();
  }

  static v1::PosePrior Prior(const Eigen::Vector3d& position, double degrees) {
    v1::PosePrior prior = fixture::PriorAt(0, 0, 0);
    *prior.mutable_pose()->mutable_translation() = World(position);
    prior.mutable_pose()->mutable_rotation()->set_w(std::cos(sensor::Radians(degrees) / 2));
    prior.mutable_pose()->mutable_rotation()->set_z(std::sin(sensor::Radians(degrees) / 2));
    return prior;
  }

  std::string Encoded(const Eigen::Vector3d& position) {
    parallel::Serial serial;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = position;
    return sensor::EncodeRangeImage(
        tracer_.Scan(scanner_, pose, simulation::ScanFaults(), ++scans_, serial));
  }

  // A piece of an encoding, every second one compressed.
  static v1::Piece PieceOf(const std::string& bytes, const v1::Upload& upload) {
    v1::Piece piece;
    piece.set_sequence(upload.next_sequence());
    piece.set_offset(upload.next_offset());
    const std::string data = bytes.substr(static_cast<size_t>(upload.next_offset()), kPieceBytes);
    piece.set_crc32c(bytes::Crc32c(data));
    if (upload.next_sequence() % 2 == 1) {
      piece.set_data(bytes::ZstdCompress(data));
      piece.set_compression(v1::COMPRESSION_ZSTD);
      piece.set_uncompressed_size_bytes(static_cast<int64_t>(data.size()));
    } else {
      piece.set_data(data);
    }
    return piece;
  }

  static v1::UploadTotal TotalOf(const std::string& bytes) {
    v1::UploadTotal total;
    total.set_encoded_size_bytes(static_cast<int64_t>(bytes.size()));
    total.set_sha256(bytes::Sha256::Of(bytes));
    return total;
  }

  // The scan, when it rests.
  std::string Send(const Eigen::Vector3d& position, const std::string& name,
                   const v1::PosePrior* prior, const std::string& scanner,
                   const std::vector<v1::TargetSighting>& targets = {}) {
    Pass(30);
    const std::string bytes = Encoded(position);
    v1::CreateUploadRequest request;
    request.set_request_id("upload-" + name);
    request.mutable_upload()->set_display_name(name);
    request.mutable_upload()->set_scanner(scanner);
    if (prior != nullptr) *request.mutable_upload()->mutable_prior() = *prior;
    for (const auto& target : targets) *request.mutable_upload()->add_targets() = target;
    const v1::UploadTotal total = TotalOf(bytes);
    if (prior == nullptr) *request.mutable_upload()->mutable_total() = total;
    absl::StatusOr<v1::Upload> upload = session_->uploads().Create(request);
    while (upload.ok() && upload->state() == v1::UPLOAD_STATE_OPEN) {
      const v1::Piece piece = PieceOf(bytes, *upload);
      upload = session_->uploads().Add(std::string(upload->name()), &piece, &total);
    }
    EXPECT_TRUE(upload.ok()) << upload.status();
    EXPECT_EQ(upload->state(), v1::UPLOAD_STATE_COMMITTED) << upload->state_message();
    Rest();
    return upload->scan();
  }

  // All the bytes of a total that announced others.
  void SendDamaged() {
    const std::string bytes = Encoded(scene_.starts[0]);
    v1::CreateUploadRequest request;
    request.set_request_id("upload-damaged");
    absl::StatusOr<v1::Upload> upload = session_->uploads().Create(request);
    v1::UploadTotal total = TotalOf(bytes);
    total.set_sha256(bytes::Sha256::Of("something else"));
    const std::string name = upload.value().name();
    while (upload.ok() && upload->state() == v1::UPLOAD_STATE_OPEN) {
      const v1::Piece piece = PieceOf(bytes, *upload);
      upload = session_->uploads().Add(name, &piece, &total);
    }
    EXPECT_EQ(session_->uploads().Get(name)->state(), v1::UPLOAD_STATE_FAILED);
  }

  // Two pieces and a total of an upload that goes on some other day.
  void LeaveUpload() {
    const std::string bytes = Encoded(scene_.starts[1]);
    v1::CreateUploadRequest request;
    request.set_request_id("upload-left");
    request.mutable_upload()->set_scanner_model_id("coarse");
    absl::StatusOr<v1::Upload> upload = session_->uploads().Create(request);
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(upload.ok()) << upload.status();
      const v1::Piece piece = PieceOf(bytes, *upload);
      upload = session_->uploads().Add(std::string(upload->name()), &piece, nullptr);
    }
    const v1::UploadTotal total = TotalOf(bytes);
    upload = session_->uploads().Add(std::string(upload->name()), nullptr, &total);
    ASSERT_TRUE(upload.ok()) << upload.status();
    EXPECT_EQ(upload->state(), v1::UPLOAD_STATE_OPEN);
  }

  v1::Claim Claim(const std::string& scanner, const v1::Vector3& position, const std::string& plan,
                  int seconds = 1200) {
    v1::ClaimViewRequest request;
    request.set_scanner(Scanner(scanner));
    *request.mutable_position() = position;
    request.set_plan(plan);
    request.mutable_ttl()->set_seconds(seconds);
    request.set_request_id(absl::StrCat("claim-", ++claims_));
    std::promise<absl::StatusOr<v1::ClaimViewResponse>> answer;
    session_->claims().Take(request, [&](absl::StatusOr<v1::ClaimViewResponse> response) {
      answer.set_value(std::move(response));
    });
    const absl::StatusOr<v1::ClaimViewResponse> response = answer.get_future().get();
    EXPECT_TRUE(response.ok()) << response.status();
    return response.ok() ? response->claim() : v1::Claim();
  }

  // Its name, when it has ended.
  std::string Plan(const std::string& id, const std::vector<std::string>& scanners, bool by_minutes,
                   double overlap = 0) {
    v1::CreatePlanRequest request;
    request.set_request_id(id);
    for (const std::string& scanner : scanners) request.mutable_plan()->add_scanners(scanner);
    request.mutable_plan()->set_work_limit_rays(500'000);
    request.mutable_plan()->set_seed(7);
    if (by_minutes) request.mutable_plan()->set_ranking(v1::RANKING_SCORE_PER_MINUTE);
    if (overlap > 0) {
      request.mutable_plan()->mutable_config_overrides()->mutable_registration()->set_min_overlap(
          overlap);
    }
    const auto plan = session_->plans().Create(request);
    EXPECT_TRUE(plan.ok()) << plan.status();
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
    return plan.ok() ? plan->name() : "";
  }

  void Cancelled() {
    v1::CreatePlanRequest request;
    request.set_request_id("plan-cancelled");
    request.mutable_plan()->mutable_time_budget()->set_seconds(600);
    request.mutable_plan()->mutable_config_overrides()->set_viewcell_size_m(0.2);
    request.mutable_plan()->mutable_config_overrides()->set_max_viewpoint_height_m(1.3);
    const auto plan = session_->plans().Create(request);
    ASSERT_TRUE(plan.ok()) << plan.status();
    ASSERT_TRUE(session_->plans().Cancel(plan->name()).ok());
    EXPECT_TRUE(host_->registry.WaitUntilIdle(std::chrono::seconds(60)));
  }

  const simulation::Scene scene_;
  const simulation::SimulatedScanner tracer_;
  sensor::ScannerModel scanner_;
  std::optional<registration::RegistrationOutcome>
      verdict_;  // instead of what an alignment comes to
  std::atomic<int> seconds_{0};
  uint64_t scans_ = 0;
  int claims_ = 0;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

}  // namespace

void RunEveryEventJob(store::Store& store) { Job(store).Run(); }

}  // namespace vantage::session
