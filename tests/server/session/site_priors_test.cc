// A prior of the site: what is refused and why, plans before the first scan, its verdict after, and
// that it is in the log, in archives, and gone when it was taken out.
#include "server/session/site_priors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/export.h"
#include "server/store/memory_store.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using testing::HasSubstr;

// The scene as OBJ, which lies where its first scan will: the world's origin is the first station.
std::string ObjOf(const simulation::Scene& scene, double unit) {
  std::string obj;
  for (const Eigen::Vector3f& v : scene.mesh.vertices) {
    absl::StrAppend(&obj, absl::StrFormat("v %.6g %.6g %.6g\n", static_cast<double>(v.x()) / unit,
                                          static_cast<double>(v.y()) / unit,
                                          static_cast<double>(v.z()) / unit));
  }
  for (const auto& t : scene.mesh.triangles) {
    absl::StrAppend(&obj, absl::StrFormat("f %d %d %d\n", t[0] + 1, t[1] + 1, t[2] + 1));
  }
  return obj;
}

v1::Vector3 Vector(const Eigen::Vector3d& p) { return conversion::WriteVector(p); }

class SitePriorsTest : public testing::Test {
 protected:
  // Two points that are a little off, in a file of that unit.
  v1::SetSitePriorRequest Request(double unit = 1) const {
    v1::SetSitePriorRequest request;
    request.set_parent("sessions/job");
    const std::string obj = ObjOf(scene_, unit);
    request.set_file(bytes::ZstdCompress(obj));
    request.set_compression(v1::COMPRESSION_ZSTD);
    request.set_uncompressed_size_bytes(static_cast<int64_t>(obj.size()));
    v1::SitePrior& prior = *request.mutable_site_prior();
    prior.set_display_name("tablet.obj");
    prior.set_unit_m(unit);
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.5, 0.5, 0), Eigen::Vector3d(5, 2, 0)}) {
      v1::SitePriorPoint& point = *prior.add_points();
      *point.mutable_prior() = Vector(p / unit);
      *point.mutable_site() = Vector(p - scene_.starts[0] + Eigen::Vector3d(0.3, -0.2, 0));
    }
    request.set_request_id("once");
    return request;
  }
  static absl::StatusOr<v1::SetSitePriorResponse> Set(Session& session,
                                                      const v1::SetSitePriorRequest& request,
                                                      PriorSource source = {}) {
    std::promise<absl::StatusOr<v1::SetSitePriorResponse>> answer;
    session.site_priors().Set(request, std::move(source),
                              [&](auto response) { answer.set_value(std::move(response)); });
    return answer.get_future().get();
  }
  static absl::StatusOr<v1::GetSitePriorResponse> Get(Session& session) {
    std::promise<absl::StatusOr<v1::GetSitePriorResponse>> answer;
    session.site_priors().Describe([&](auto response) { answer.set_value(std::move(response)); });
    return answer.get_future().get();
  }
  static std::string BlobOf(const Session& session) {
    std::string blob;
    session.journal().Read([&](const SessionState& state) { blob = state.site_prior_blob; });
    return blob;
  }
  absl::Status Clear(Session& session) const {
    v1::ClearSitePriorRequest request;
    request.set_parent("sessions/job");
    return session.site_priors().Clear(request);
  }
  void Scan(Session& session, size_t start) {
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.5);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene_.starts[start];
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulation::SimulatedScanner(scene_.mesh)
                     .Scan(scanner, pose, simulation::ScanFaults{}, 1, pool_);
    const auto sent = fixture::SendScan(session, sensor::EncodeRangeImage(scan.image));
    ASSERT_TRUE(sent.ok()) << sent.status();
    session.WaitUntilIdle();
  }
  // The plan when it has ended.
  static v1::Plan Plan(Session& session) {
    v1::CreatePlanRequest request;
    request.mutable_plan()->set_work_limit_rays(3'000'000);
    const auto created = session.plans().Create(request);
    EXPECT_TRUE(created.ok()) << created.status();
    if (!created.ok()) return {};
    for (int i = 0; i < 3000; ++i) {
      const auto plan = session.plans().Get(created->name());
      if (plan.ok() && plan->state() != v1::PLAN_STATE_QUEUED &&
          plan->state() != v1::PLAN_STATE_RUNNING) {
        return *plan;
      }
      absl::SleepFor(absl::Milliseconds(10));
    }
    ADD_FAILURE() << "the plan does not end";
    return {};
  }

  const simulation::Scene scene_ = simulation::TwoRooms(1);
  parallel::ThreadPool pool_{2};
  store::MemoryStore store_{256 << 20};
  fixture::SessionHost host_{store_, Algorithms::Core()};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
};

TEST_F(SitePriorsTest, SaysWhatIsWrongWithAFileAndGoesOnWithoutIt) {
  const auto millimetres = [&] {
    v1::SetSitePriorRequest request = Request(0.001);
    request.mutable_site_prior()->clear_unit_m();
    return Set(*session_, request);
  }();
  EXPECT_EQ(millimetres.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(millimetres.status().message(), HasSubstr("give the unit, mm"));

  v1::SetSitePriorRequest apart = Request();
  apart.mutable_site_prior()->mutable_points(1)->mutable_prior()->set_x(40);
  const auto contradicts = Set(*session_, apart);
  EXPECT_EQ(contradicts.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(contradicts.status().message(), HasSubstr("m apart in the prior and"));

  v1::SetSitePriorRequest empty = Request();
  empty.set_compression(v1::COMPRESSION_NONE);
  empty.set_file("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_EQ(Set(*session_, empty).status().code(), absl::StatusCode::kInvalidArgument);

  EXPECT_EQ(Get(*session_).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Clear(*session_).code(), absl::StatusCode::kNotFound);
}

TEST_F(SitePriorsTest, PlansBeforeTheFirstScanAndIsAlignedByIt) {
  v1::CreatePlanRequest without;
  without.mutable_plan()->set_work_limit_rays(100'000);
  EXPECT_EQ(session_->plans().Create(without).status().code(),
            absl::StatusCode::kFailedPrecondition);
  const auto set = Set(*session_, Request(0.001));
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(set->site_prior().name(), "sessions/job/sitePrior");
  EXPECT_EQ(set->site_prior().format(), v1::SITE_PRIOR_FORMAT_OBJ);
  EXPECT_GT(set->site_prior().triangle_count(), 10);
  // Sent again, it answers as before.
  const auto again = Set(*session_, Request(0.001));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->site_prior().create_time().seconds(), set->site_prior().create_time().seconds());

  auto standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_PLACED);
  const v1::Plan first = Plan(*session_);
  ASSERT_EQ(first.state(), v1::PLAN_STATE_SUCCEEDED) << first.state_message();
  ASSERT_GT(first.result().views_size(), 0) << first.result().message();
  EXPECT_TRUE(first.result().views(0).expected_station().by_site_prior());

  Scan(*session_, 0);
  standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_ALIGNED)
      << standing->standing().message();
  EXPECT_GT(standing->standing().agreeing_share(), 0.8);
  EXPECT_LT(standing->standing().refuted_share(), 0.1);
  const v1::Plan second = Plan(*session_);
  ASSERT_EQ(second.state(), v1::PLAN_STATE_SUCCEEDED) << second.state_message();

  ASSERT_TRUE(Clear(*session_).ok());
  EXPECT_EQ(Get(*session_).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SitePriorsTest, IsThereAfterARestartAndInAnArchiveAndGoneWhenItIsTakenOut) {
  ASSERT_TRUE(Set(*session_, Request()).ok());
  v1::SetSitePriorRequest second = Request();
  second.set_request_id("twice");
  second.mutable_site_prior()->set_display_name("again.obj");
  ASSERT_TRUE(Set(*session_, second).ok());
  {
    fixture::SessionHost other(store_, Algorithms::Core());
    const auto loaded = fixture::LoadSession(other.registry, "job");
    const auto there = Get(*loaded);
    ASSERT_TRUE(there.ok()) << there.status();
    EXPECT_EQ(there->site_prior().display_name(), "again.obj");
    EXPECT_EQ(there->standing().state(), v1::SITE_PRIOR_STATE_PLACED);
  }
  v1::ExportModelRequest request;
  request.set_format(v1::EXPORT_FORMAT_ARCHIVE);
  const auto source = Export::Create(session_, request).value();
  v1::ImportSessionRequest import;
  for (std::string part = source->Next().value(); !part.empty(); part = source->Next().value()) {
    import.mutable_data()->append(part);
  }
  import.set_request_id("import");
  import.set_session_id("copy");
  import.set_crc32c(bytes::Crc32c(import.data()));
  store::MemoryStore elsewhere(256 << 20);
  fixture::SessionHost other(elsewhere, Algorithms::Core());
  const auto imported = other.registry.Import(import, "");
  ASSERT_TRUE(imported.ok()) << imported.status();
  const auto there = Get(*fixture::LoadSession(other.registry, "copy"));
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_EQ(there->site_prior().name(), "sessions/copy/sitePrior");

  const std::string blob = BlobOf(*session_);
  ASSERT_TRUE(store_.GetBlob(blob).ok());
  ASSERT_TRUE(Clear(*session_).ok());
  EXPECT_EQ(BlobOf(*session_), "");
  EXPECT_FALSE(store_.GetBlob(blob).ok());
}

}  // namespace
}  // namespace vantage::session
