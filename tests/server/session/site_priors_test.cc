// A prior of the site: what is refused and why, plans before the first scan, its verdict after, and
// that it is in the log, in archives, and gone when it was taken out.
#include "server/session/site_priors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <new>
#include <optional>
#include <stop_token>
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
#include "core/site_prior/prior_space.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/archive_reader.h"
#include "server/session/asked_evaluation.h"
#include "server/session/export.h"
#include "server/session/plan_inputs.h"
#include "server/session/site_prior_use.h"
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

// A box of walls, floor and ceiling.
std::string BoxObj(double x, double y, double z) {
  std::string obj;
  for (int i = 0; i < 8; ++i) {
    absl::StrAppend(&obj,
                    absl::StrFormat("v %g %g %g\n", (i & 1) * x, (i >> 1 & 1) * y, (i >> 2) * z));
  }
  return obj +
         "f 1 2 4\nf 1 4 3\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 4 8\nf 3 8 7\n"
         "f 1 3 7\nf 1 7 5\nf 2 4 8\nf 2 8 6\n";
}

v1::Vector3 Vector(const Eigen::Vector3d& p) { return conversion::WriteVector(p); }

bool SaysWhenToRetry(const absl::Status& status) {
  return status.GetPayload("type.googleapis.com/google.rpc.RetryInfo").has_value();
}

// Whose blobs cannot be read for a while, and that counts how often they are.
class UnsteadyStore : public store::MemoryStore {
 public:
  UnsteadyStore() : MemoryStore(size_t{256} << 20) {}
  absl::StatusOr<std::string> GetBlob(const std::string& sha256) const override {
    ++read;
    while (waits) absl::SleepFor(absl::Milliseconds(2));
    if (fails) return absl::UnavailableError("the disk does not answer");
    return MemoryStore::GetBlob(sha256);
  }
  std::atomic<bool> fails{false};
  std::atomic<bool> waits{false};
  mutable std::atomic<int> read{0};
};

class SitePriorsTest : public testing::Test {
 protected:
  static void AddPoint(v1::SitePrior& prior, const Eigen::Vector3d& in_prior,
                       const Eigen::Vector3d& at_site) {
    v1::SitePriorPoint& point = *prior.add_points();
    *point.mutable_prior() = Vector(in_prior);
    *point.mutable_site() = Vector(at_site);
  }
  // A file that lies where its own origin is.
  static v1::SetSitePriorRequest Of(const std::string& file) {
    v1::SetSitePriorRequest request;
    request.set_parent("sessions/job");
    request.set_file(bytes::ZstdCompress(file));
    request.set_compression(v1::COMPRESSION_ZSTD);
    request.set_uncompressed_size_bytes(static_cast<int64_t>(file.size()));
    AddPoint(*request.mutable_site_prior(), {0, 0, 0}, {0, 0, 0});
    AddPoint(*request.mutable_site_prior(), {3, 2, 0}, {3, 2, 0});
    return request;
  }
  // The scene, by two points that are a little off, in a file of that unit. `moved`: m, of the
  // world.
  v1::SetSitePriorRequest Request(double unit = 1,
                                  const Eigen::Vector3d& moved = Eigen::Vector3d::Zero()) const {
    v1::SetSitePriorRequest request = Of(ObjOf(scene_, unit));
    v1::SitePrior& prior = *request.mutable_site_prior();
    prior.set_display_name("tablet.obj");
    prior.set_unit_m(unit);
    prior.clear_points();
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(0.5, 0.5, 0), Eigen::Vector3d(5, 2, 0)}) {
      AddPoint(prior, p / unit, p - scene_.starts[0] + Eigen::Vector3d(0.3, -0.2, 0) + moved);
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
  static absl::StatusOr<v1::GetSitePriorResponse> Get(Session& session,
                                                      const v1::GetSitePriorRequest& request = {},
                                                      const std::stop_token& gone = {}) {
    std::promise<absl::StatusOr<v1::GetSitePriorResponse>> answer;
    session.site_priors().Describe(
        request, [&](auto response) { answer.set_value(std::move(response)); }, gone);
    return answer.get_future().get();
  }
  static std::string BlobOf(const Session& session) {
    std::string blob;
    session.journal().Read([&](const SessionState& state) { blob = state.site_prior_blob; });
    return blob;
  }
  static absl::Status Clear(Session& session) {
    v1::ClearSitePriorRequest request;
    request.set_parent("sessions/job");
    return session.site_priors().Clear(request);
  }
  // Where the scene lies by its first scan, m, world.
  Eigen::AlignedBox3d SiteBox() const {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3f& v : scene_.mesh.vertices) {
      box.extend(v.cast<double>() - scene_.starts[0]);
    }
    return box;
  }
  // From the scene's first start, which lies at `world`.
  void Scan(Session& session, const Eigen::Vector3d& world = Eigen::Vector3d::Zero()) {
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(1.0);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene_.starts[0];
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulation::SimulatedScanner(scene_.mesh)
                     .Scan(scanner, pose, simulation::ScanFaults{}, 1, pool_);
    const v1::PosePrior at = fixture::PriorAt(world.x(), world.y(), world.z());
    const auto sent = fixture::SendScan(session, sensor::EncodeRangeImage(scan.image),
                                        world.isZero() ? nullptr : &at);
    ASSERT_TRUE(sent.ok()) << sent.status();
    session.WaitUntilIdle();
  }
  // The plan when it has ended.
  static v1::Plan Plan(Session& session, v1::Ranking ranking = v1::RANKING_UNSPECIFIED) {
    v1::CreatePlanRequest request;
    request.mutable_plan()->set_ranking(ranking);
    request.mutable_plan()->set_work_limit_rays(300'000);
    const auto created = session.plans().Create(request);
    EXPECT_TRUE(created.ok()) << created.status();
    if (!created.ok()) return {};
    for (int i = 0; i < 6000; ++i) {
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
  static std::string Archive(const std::shared_ptr<Session>& session) {
    v1::ExportModelRequest request;
    request.set_format(v1::EXPORT_FORMAT_ARCHIVE);
    const auto source = Export::Create(session, request).value();
    std::string archive;
    while (true) {
      const std::string part = source->Next().value();
      if (part.empty()) return archive;
      archive += part;
    }
  }
  static absl::StatusOr<v1::ImportSessionResponse> Import(SessionRegistry& registry,
                                                          const std::string& archive) {
    v1::ImportSessionRequest request;
    request.set_request_id("import");
    request.set_session_id("copy");
    request.set_data(archive);
    request.set_crc32c(bytes::Crc32c(archive));
    return registry.Import(request, "");
  }

  const simulation::Scene scene_ = simulation::TwoRooms(1);
  parallel::ThreadPool pool_{2};
  UnsteadyStore store_;
  fixture::SessionHost host_{store_, Algorithms::Core()};
  std::shared_ptr<Session> session_ = fixture::OpenSession(host_.registry, "job");
};

// Each with a canonical code, the field and the cure; and nothing of them stays.
TEST_F(SitePriorsTest, SaysWhatIsWrongWithAFileAndGoesOnWithoutIt) {
  const auto refused = [&](const v1::SetSitePriorRequest& request, absl::StatusCode code,
                           const char* field, const char* cure) {
    const absl::Status status = Set(*session_, request).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(status.ToString(), testing::AllOf(HasSubstr(field), HasSubstr(cure)));
    EXPECT_EQ(BlobOf(*session_), "");
  };
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;

  v1::SetSitePriorRequest millimetres = Request(0.001);
  millimetres.mutable_site_prior()->clear_unit_m();
  refused(millimetres, kInvalid, "file", "give the unit, mm");

  v1::SetSitePriorRequest apart = Request();
  apart.mutable_site_prior()->mutable_points(1)->mutable_prior()->set_x(40);
  refused(apart, kInvalid, "site_prior.points", "take the points again, or the scale");
  v1::SetSitePriorRequest scaled = Request();
  scaled.mutable_site_prior()->set_scale(3);
  refused(scaled, kInvalid, "site_prior.points", "the scale of the prior is wrong");
  v1::SetSitePriorRequest grid = Request(1, {691'412, 5'335'120, 0});
  refused(grid, kInvalid, "site_prior.points", "in a national grid, state session.origin");

  refused(Of("v 0 0 0\nv 1 0 0\nv 0 1 0\n"), kInvalid, "file", "");
  refused(Of(" "), kInvalid, "file", "PLY or OBJ");
  refused(Of("  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n  0\nEOF\n"), kInvalid, "file",
          "the plan is empty");
  std::string open = "0\nSECTION\n2\nENTITIES\n";
  for (const char* line : {"10\n0\n20\n0\n11\n6\n21\n0\n", "10\n0\n20\n0\n11\n0\n21\n5\n"}) {
    absl::StrAppend(&open, "0\nLINE\n8\n0\n", line);
  }
  refused(Of(open + "0\nENDSEC\n0\nEOF\n"), kInvalid, "file", "close gaps of the outer walls");
  refused(Of("v 0 0 0\nv 4 0 0\nv 4 0 3\nv 0 0 3\nf 1 2 3\nf 1 3 4\n"), kInvalid, "file",
          "is its floor there?");

  refused(Of(BoxObj(5000, 4000, 3)), kInvalid, "file", "is 5000 m wide: give the unit");
  std::string sliver = BoxObj(1500, 4, 3);
  for (int i = 0; i < 400; ++i) absl::StrAppend(&sliver, "f 1 8 ", i % 2 == 0 ? 2 : 3, "\n");
  refused(Of(sliver), kInvalid, "file", "without long slivers");

  EXPECT_EQ(Get(*session_).status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(Clear(*session_).code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(Set(*session_, Of(BoxObj(4, 3, 2.6))).ok()) << "the session goes on";
}

TEST_F(SitePriorsTest, TakesAScaleFromPointsThatAreFarApart) {
  std::string picture = "\x89PNG\r\n\x1a\n";
  v1::SetSitePriorRequest request = Of(picture);
  request.mutable_site_prior()->clear_points();
  AddPoint(*request.mutable_site_prior(), {10, 10, 0}, {0, 0, 0});
  AddPoint(*request.mutable_site_prior(), {210, 10, 0}, {4, 0, 0});
  const absl::Status near = Set(*session_, request).status();
  EXPECT_EQ(near.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(near.ToString(), testing::AllOf(HasSubstr("site_prior.unit_m"),
                                              HasSubstr("these are 4.0 m and 200 pixels")));
  request.mutable_site_prior()->mutable_points(1)->mutable_site()->set_x(6);
  // Then the file is looked at.
  EXPECT_THAT(Set(*session_, request).status().ToString(), HasSubstr("picture"));
}

TEST_F(SitePriorsTest, SaysWhatIsTooLargeForTheModelsVoxels) {
  const absl::Status huge = Set(*session_, Of(BoxObj(120, 90, 3))).status();
  EXPECT_EQ(huge.code(), absl::StatusCode::kResourceExhausted) << huge;
  EXPECT_EQ(contract::ReasonOf(huge), "FILE_TOO_LARGE");
  EXPECT_THAT(huge.message(), testing::AllOf(HasSubstr("file: the prior has more than 10000 m2"),
                                             HasSubstr("give the part that is to be scanned")));
  v1::Session described;
  described.mutable_model_config()->set_voxel_size_m(0.02);
  v1::CreateSessionRequest create;
  *create.mutable_session() = described;
  create.set_session_id("fine");
  const auto fine = host_.registry.Create(create, "");
  ASSERT_TRUE(fine.ok()) << fine.status();
  const absl::Status status = Set(**fine, Of(BoxObj(32, 32, 3))).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(contract::ReasonOf(status), "FILE_TOO_LARGE");
  EXPECT_THAT(status.message(), testing::AllOf(HasSubstr("in voxels of 0.02 m"),
                                               HasSubstr("voxel_size_m is larger")));
}

// Another place than what was scanned: the scans contradict it, wherever it is moved to.
TEST_F(SitePriorsTest, IsNotUsedWhereTheScansContradictIt) {
  Scan(*session_);
  ASSERT_EQ(session_->Describe().scan_counts().merged_count(), 1);
  // The scanner would stand in a wall of a hall.
  v1::SetSitePriorRequest hall = Of(BoxObj(12, 9, 4));
  hall.mutable_site_prior()->clear_points();
  AddPoint(*hall.mutable_site_prior(), {0, 0, 0}, {0, 0, -1.5});
  AddPoint(*hall.mutable_site_prior(), {12, 0, 0}, {12, 0, -1.5});
  ASSERT_TRUE(Set(*session_, hall).ok());
  const auto standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_NOT_ALIGNED);
  EXPECT_THAT(standing->standing().message(),
              testing::AllOf(HasSubstr("the prior is not used"), HasSubstr("place it anew")));
  const v1::Plan plan = Plan(*session_);
  EXPECT_EQ(plan.state(), v1::PLAN_STATE_SUCCEEDED) << plan.state_message();
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

  Scan(*session_);
  standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_ALIGNED)
      << standing->standing().message();
  EXPECT_GT(standing->standing().agreeing_share(), 0.8);
  EXPECT_LT(standing->standing().refuted_share(), 0.1);
  const v1::Plan second = Plan(*session_);
  ASSERT_EQ(second.state(), v1::PLAN_STATE_SUCCEEDED) << second.state_message();

  // Plans for several scanners, and by minutes, count on it, too.
  const v1::Plan with = Plan(*session_, v1::RANKING_SCORE_PER_MINUTE);
  ASSERT_EQ(with.state(), v1::PLAN_STATE_SUCCEEDED) << with.state_message();
  ASSERT_GT(with.result().refused_size(), 0) << with.result().message();
  ASSERT_TRUE(Clear(*session_).ok());
  EXPECT_EQ(Get(*session_).status().code(), absl::StatusCode::kNotFound);
  const v1::Plan after = Plan(*session_, v1::RANKING_SCORE_PER_MINUTE);
  ASSERT_GT(after.result().refused_size(), 0) << after.result().message();
  EXPECT_NE(with.result().refused(0).expected_gain_m2(),
            after.result().refused(0).expected_gain_m2());
}

TEST_F(SitePriorsTest, IsThereAfterARestartAndInAnArchiveAndGoneWhenItIsTakenOut) {
  v1::SetSitePriorRequest first = Of(BoxObj(4, 3, 2.6));
  first.set_request_id("once");
  ASSERT_TRUE(Set(*session_, first).ok());
  v1::SetSitePriorRequest second = Of(BoxObj(5, 3, 2.6));
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
  store::MemoryStore elsewhere(256 << 20);
  fixture::SessionHost other(elsewhere, Algorithms::Core());
  const auto imported = Import(other.registry, Archive(session_));
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

TEST_F(SitePriorsTest, RefusesArchivesWithPriorsThatNoServerWouldHaveLogged) {
  ASSERT_TRUE(Set(*session_, Of(BoxObj(4, 3, 2.6))).ok());
  std::vector<storage::v1::ArchiveRecord> records;
  ArchiveReader reader;
  reader.Add(Archive(session_));
  while (const auto record = reader.Next().value()) records.push_back(*record);
  store::MemoryStore elsewhere(256 << 20);
  fixture::SessionHost other(elsewhere, Algorithms::Core());
  const auto import = [&](auto&& change) {
    std::string archive;
    for (storage::v1::ArchiveRecord record : records) {
      change(record);
      if (record.has_end()) record.mutable_end()->set_sha256(bytes::Sha256::Of(archive));
      archive += WriteArchiveRecord(record);
    }
    return Import(other.registry, archive).status();
  };
  const auto with = [&](auto&& change) {
    return import([&](storage::v1::ArchiveRecord& record) {
      if (!record.entry().event().has_site_prior_set()) return;
      change(
          *record.mutable_entry()->mutable_event()->mutable_site_prior_set()->mutable_site_prior());
    });
  };
  const auto expect = [](const absl::Status& status, const char* field) {
    EXPECT_EQ(contract::ReasonOf(status), "ARCHIVE_DAMAGED") << status;
    EXPECT_THAT(status.message(), HasSubstr(field));
  };
  expect(with([](v1::SitePrior& prior) { prior.clear_name(); }), "site_prior.name");
  expect(with([](v1::SitePrior& prior) { prior.set_accuracy_m(0.9); }), "site_prior.accuracy_m");
  expect(with([](v1::SitePrior& prior) { prior.set_unit_m(0); }), "site_prior.unit_m");
  expect(with([](v1::SitePrior& prior) { prior.set_triangle_count(-1); }),
         "site_prior.triangle_count");
  expect(import([](storage::v1::ArchiveRecord& record) {
           if (record.entry().event().has_site_prior_set()) record.mutable_entry()->clear_blob();
         }),
         "");
  const auto sized = [&](int64_t size) {
    return import([&](storage::v1::ArchiveRecord& record) {
      if (record.has_blob()) record.mutable_blob()->set_size_bytes(size);
    });
  };
  expect(sized(kMostPriorBlob + 1), "larger than one may be");
  expect(sized(kMostPriorBlob), "missing");  // beyond what plans may be
  EXPECT_TRUE(import([](storage::v1::ArchiveRecord&) {}).ok());
}

// The model's origin is moved to the first scan, in coordinates of a grid.
TEST_F(SitePriorsTest, LiesWhereItWasPlacedWhenTheOriginMoves) {
  const Eigen::Vector3d grid(3000, 2000, 0);
  ASSERT_TRUE(Set(*session_, Request(1, grid)).ok());
  auto standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_PLACED);
  const double x = standing->standing().pose().translation().x();
  EXPECT_NEAR(x, 3000.3 - scene_.starts[0].x(), 0.01);
  Scan(*session_, grid);
  ASSERT_EQ(session_->Describe().scan_counts().merged_count(), 1);
  ASSERT_EQ(session_->Describe().origin().x(), 3000);
  standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_ALIGNED)
      << standing->standing().message();
  EXPECT_NEAR(standing->standing().pose().translation().x(), 3000 - scene_.starts[0].x(), 0.1);
}

// Another session's model, whose points are in that session's world.
TEST_F(SitePriorsTest, IsAnotherSessionsModelWhereverThatLies) {
  const Eigen::Vector3d grid(3000, 2000, 0);
  const auto source = fixture::OpenSession(host_.registry, "source");
  Scan(*source, grid);
  ASSERT_EQ(source->origin().x(), 3000);
  v1::SetSitePriorRequest request;
  request.set_parent("sessions/job");
  v1::SitePrior& prior = *request.mutable_site_prior();
  prior.set_source_session("sessions/source");
  AddPoint(prior, grid, {0.2, 0, 0});
  AddPoint(prior, grid + Eigen::Vector3d(5, 1, 0), {5.2, 1, 0});
  // What only a server says.
  prior.set_file_size_bytes(77);
  prior.set_name("sessions/other/sitePrior");
  const PriorSource model{source->model().Current().view, source->origin()};
  const auto set = Set(*session_, request, model);
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_EQ(set->site_prior().format(), v1::SITE_PRIOR_FORMAT_SESSION);
  EXPECT_EQ(set->site_prior().source_origin().x(), 3000);
  EXPECT_EQ(set->site_prior().name(), "sessions/job/sitePrior");
  EXPECT_EQ(set->site_prior().file_size_bytes(), 0);
  auto standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_NEAR(standing->standing().pose().translation().x(), -2999.8, 0.01);
  Scan(*session_);
  standing = Get(*session_);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_ALIGNED)
      << standing->standing().message();

  // The same twice at a time holds its triangles once.
  request.set_request_id("at a time");
  std::promise<absl::Status> first;
  std::promise<absl::Status> second;
  session_->site_priors().Set(request, model, [&](auto r) { first.set_value(r.status()); });
  session_->site_priors().Set(request, model, [&](auto r) { second.set_value(r.status()); });
  EXPECT_TRUE(first.get_future().get().ok());
  EXPECT_TRUE(second.get_future().get().ok());
  const std::string blob = BlobOf(*session_);
  ASSERT_TRUE(Clear(*session_).ok());
  EXPECT_EQ(store_.GetBlob(blob).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(SitePriorsTest, TellsWhatPassesFromWhatLasts) {
  ASSERT_TRUE(Set(*session_, Of(BoxObj(4, 3, 2.6))).ok());
  store_.fails = true;
  EXPECT_EQ(Get(*session_).status().code(), absl::StatusCode::kUnavailable);
  const v1::Plan none = Plan(*session_);
  EXPECT_EQ(none.state(), v1::PLAN_STATE_FAILED);
  EXPECT_THAT(none.state_message(), HasSubstr("the disk does not answer"));
  store_.fails = false;
  const v1::Plan plan = Plan(*session_);
  EXPECT_EQ(plan.state(), v1::PLAN_STATE_SUCCEEDED) << plan.state_message();
  EXPECT_GT(plan.result().views_size(), 0);
  EXPECT_EQ(Get(*session_)->standing().state(), v1::SITE_PRIOR_STATE_PLACED);

  session_->model().site_prior().Forget();
  ASSERT_TRUE(store_.ReleaseBlob(BlobOf(*session_)).ok());
  const auto lost = Get(*session_);
  ASSERT_TRUE(lost.ok()) << lost.status();
  EXPECT_EQ(lost->standing().state(), v1::SITE_PRIOR_STATE_UNUSABLE);
  EXPECT_THAT(lost->standing().message(), HasSubstr("set it again"));
}

// One is made, for which others wait.
TEST_F(SitePriorsTest, IsMadeOnceForAllWhoAsk) {
  ASSERT_TRUE(Set(*session_, Request()).ok());
  store_.read = 0;
  std::vector<std::promise<absl::Status>> answers(2);
  for (std::promise<absl::Status>& answer : answers) {
    session_->site_priors().Describe({},
                                     [&](auto response) { answer.set_value(response.status()); });
  }
  for (std::promise<absl::Status>& answer : answers) {
    EXPECT_TRUE(answer.get_future().get().ok());
  }
  EXPECT_EQ(store_.read, 1);
}

// Whoever lost the answer hears what became of the request, and not of another's prior.
TEST_F(SitePriorsTest, ARepeatedRequestIsAnsweredByItsOwnPriorOrNotAtAll) {
  v1::SetSitePriorRequest first = Of(BoxObj(4, 3, 2.6));
  first.set_request_id("first");
  first.mutable_site_prior()->set_display_name("first.obj");
  ASSERT_TRUE(Set(*session_, first).ok());
  EXPECT_EQ(Set(*session_, first)->site_prior().display_name(), "first.obj");
  v1::SetSitePriorRequest second = Of(BoxObj(5, 3, 2.6));
  second.set_request_id("second");
  second.mutable_site_prior()->set_display_name("second.obj");
  ASSERT_TRUE(Set(*session_, second).ok());
  const auto expect_replaced = [&](const v1::SetSitePriorRequest& request) {
    const absl::Status again = Set(*session_, request).status();
    EXPECT_EQ(again.code(), absl::StatusCode::kAborted) << again;
    EXPECT_EQ(contract::ReasonOf(again), "SITE_PRIOR_REPLACED");
  };
  expect_replaced(first);
  EXPECT_EQ(Set(*session_, second)->site_prior().display_name(), "second.obj");
  v1::SetSitePriorRequest reused = second;
  reused.mutable_site_prior()->set_display_name("other.obj");
  EXPECT_EQ(contract::ReasonOf(Set(*session_, reused).status()), "REQUEST_ID_REUSED");
  ASSERT_TRUE(Clear(*session_).ok());
  expect_replaced(second);
  EXPECT_EQ(BlobOf(*session_), "") << "nothing is set by it";
}

// Its outer walls, where they are at the site.
TEST_F(SitePriorsTest, ItsWallsAreToldToWhoAsksForThem) {
  v1::SetSitePriorRequest set = Of(BoxObj(4000, 3000, 2600));
  v1::SitePrior& prior = *set.mutable_site_prior();
  prior.set_unit_m(0.001);
  prior.clear_points();
  AddPoint(prior, {0, 0, 0}, {10, 20, 0.5});  // turned by a quarter
  AddPoint(prior, {4000, 0, 0}, {10, 24, 0.5});
  ASSERT_TRUE(Set(*session_, set).ok());
  EXPECT_EQ(Get(*session_)->walls_size(), 0) << "they were not asked for";
  v1::GetSitePriorRequest with;
  with.set_with_walls(true);
  const auto placed = Get(*session_, with);
  ASSERT_TRUE(placed.ok()) << placed.status();
  ASSERT_EQ(placed->walls_size(), 1);
  const auto& corners = placed->walls(0).corners();
  ASSERT_GE(corners.size(), 5);
  EXPECT_NEAR(corners[0].x(), corners[corners.size() - 1].x(), 1e-6);
  double length = 0;
  for (int i = 0; i < corners.size(); ++i) {
    EXPECT_NEAR(corners[i].z(), 0.5, 0.1);
    EXPECT_GE(corners[i].x(), 7 - 1e-3);
    EXPECT_LE(corners[i].x(), 10 + 1e-3);
    EXPECT_GE(corners[i].y(), 20 - 1e-3);
    EXPECT_LE(corners[i].y(), 24 + 1e-3);
    if (i > 0) {
      length +=
          std::hypot(corners[i].x() - corners[i - 1].x(), corners[i].y() - corners[i - 1].y());
    }
  }
  EXPECT_NEAR(length, 14, 0.01);
}

// Where it is known not to lie nobody draws it.
TEST_F(SitePriorsTest, WallsOfAPriorThatIsElsewhereAreNotTold) {
  Scan(*session_);
  v1::SetSitePriorRequest hall = Of(BoxObj(12, 9, 4));
  hall.mutable_site_prior()->clear_points();
  AddPoint(*hall.mutable_site_prior(), {0, 0, 0}, {0, 0, -1.5});
  AddPoint(*hall.mutable_site_prior(), {12, 0, 0}, {12, 0, -1.5});
  ASSERT_TRUE(Set(*session_, hall).ok());
  v1::GetSitePriorRequest with;
  with.set_with_walls(true);
  auto standing = Get(*session_, with);
  ASSERT_TRUE(standing.ok()) << standing.status();
  ASSERT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_NOT_ALIGNED);
  EXPECT_EQ(standing->walls_size(), 0);
  // What fits is drawn where the scans put it.
  ASSERT_TRUE(Set(*session_, Request()).ok());
  standing = Get(*session_, with);
  ASSERT_TRUE(standing.ok()) << standing.status();
  ASSERT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_ALIGNED);
  ASSERT_GT(standing->walls_size(), 0);
  const Eigen::AlignedBox3d box = SiteBox();
  for (const v1::SitePriorWall& wall : standing->walls()) {
    for (const v1::Vector3& corner : wall.corners()) {
      EXPECT_LE(box.exteriorDistance(Eigen::Vector3d(corner.x(), corner.y(), corner.z())), 0.1);
    }
  }
}

// Who has gone is waited for by nobody, and the next one gets an answer.
TEST_F(SitePriorsTest, IsNotComparedForWhoHasGone) {
  ASSERT_TRUE(Set(*session_, Request()).ok());
  std::stop_source gone;
  gone.request_stop();
  store_.read = 0;
  EXPECT_FALSE(Get(*session_, {}, gone.get_token()).ok());
  EXPECT_TRUE(Get(*session_).ok());
}

// Who waits for a prior that another's call is making ends when its caller has gone, and when the
// server shuts down; a claim that nobody waits for is not taken.
TEST_F(SitePriorsTest, AClaimWaitsForItNoLongerThanItsCallerDoes) {
  Scan(*session_);
  for (const char* id : {"red", "blue"}) {
    v1::CreateScannerRequest request;
    request.set_scanner_id(id);
    request.mutable_scanner();
    ASSERT_TRUE(session_->scanners().Create(request).ok());
  }
  ASSERT_TRUE(Set(*session_, Request()).ok());
  ASSERT_TRUE(host_.registry.WaitUntilIdle(std::chrono::seconds(60)));
  using Answer = absl::StatusOr<v1::ClaimViewResponse>;
  const auto claim = [&](const char* id, double x, const std::stop_token& gone) {
    v1::ClaimViewRequest request;
    request.set_scanner(absl::StrCat("sessions/job/scanners/", id));
    request.mutable_position()->set_x(x);
    auto answer = std::make_shared<std::promise<Answer>>();
    session_->claims().Take(
        request, [answer](Answer response) { answer->set_value(std::move(response)); }, "", gone);
    return answer->get_future();
  };
  ASSERT_TRUE(claim("red", 0, {}).get().ok());
  session_->model().site_prior().Forget();
  store_.read = 0;
  store_.waits = true;
  std::promise<absl::Status> described;
  session_->site_priors().Describe({}, [&](auto r) { described.set_value(r.status()); });
  while (store_.read == 0) absl::SleepFor(absl::Milliseconds(1));
  std::stop_source gone;
  std::future<Answer> waiting = claim("blue", 1, gone.get_token());
  EXPECT_EQ(waiting.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  gone.request_stop();
  EXPECT_EQ(waiting.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  std::future<Answer> draining = claim("blue", 1, {});
  session_->claims().Stop();
  EXPECT_EQ(draining.wait_for(std::chrono::seconds(20)), std::future_status::ready);
  store_.waits = false;
  EXPECT_FALSE(waiting.get().ok());
  EXPECT_EQ(contract::ReasonOf(draining.get().status()), "DRAINING");
  EXPECT_TRUE(described.get_future().get().ok());
  bool more = false;
  EXPECT_EQ(session_->claims().List("", 10, more)->size(), 1U);
}

TEST_F(SitePriorsTest, CanBeTakenOutWithoutAName) {
  const auto blob = store_.PutBlob("triangles");
  ASSERT_TRUE(blob.ok());
  ASSERT_TRUE(session_->journal()
                  .Execute({},
                           [&](const SessionState&) -> absl::StatusOr<Draft> {
                             Draft draft;
                             draft.event.mutable_site_prior_set()->mutable_site_prior();
                             draft.blob = *blob;
                             return draft;
                           })
                  .ok());
  EXPECT_TRUE(Clear(*session_).ok());
  EXPECT_EQ(BlobOf(*session_), "");
}

TEST_F(SitePriorsTest, EndsWithTheServer) {
  ASSERT_TRUE(Set(*session_, Of(BoxObj(4, 3, 2.6))).ok());
  session_->site_priors().Stop();
  for (const absl::Status& status :
       {Set(*session_, Of(BoxObj(5, 3, 2.6))).status(), Get(*session_).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable) << status;
    EXPECT_EQ(contract::ReasonOf(status), "DRAINING");
  }
}

TEST_F(SitePriorsTest, TakesItsTurnAndNoMoreThanIsAllowed) {
  store::MemoryStore store(256 << 20);
  contract::Limits limits;
  limits.evaluations = 0;
  {
    fixture::SessionHost host(store, Algorithms::Core(), limits);
    const auto session = fixture::OpenSession(host.registry, "none");
    EXPECT_EQ(contract::ReasonOf(Set(*session, Of(BoxObj(4, 3, 2.6))).status()),
              "TOO_MANY_EVALUATIONS");
  }
  limits = {};
  limits.file_seconds = 0.01;
  std::string large = BoxObj(4, 3, 2.6);
  for (int i = 0; i < 200'000; ++i) absl::StrAppend(&large, "f 1 2 4\n");
  {
    fixture::SessionHost host(store, Algorithms::Core(), limits);
    const auto session = fixture::OpenSession(host.registry, "slow");
    // It ends while its reader starts, or soon after.
    EXPECT_THAT(Set(*session, Of(large)).status().message(), HasSubstr("--file-seconds"));
  }
  // With the files of scans.
  telemetry::Log log = telemetry::Log::Silent();
  execution::Timer timer;
  execution::PlanningPool pool(2, 8);
  SessionDependencies dependencies{store,
                                   pool,
                                   timer,
                                   log,
                                   {},
                                   Algorithms::Core(),
                                   fixture::FixtureTime,
                                   nullptr,
                                   nullptr,
                                   fixture::SeenBy(fixture::FixtureTime)};
  dependencies.files = std::make_shared<FileReadings>(1);
  {
    SessionRegistry registry(dependencies);
    const auto session = fixture::OpenSession(registry, "turn");
    dependencies.files->Stop();
    EXPECT_EQ(contract::ReasonOf(Set(*session, Of(BoxObj(4, 3, 2.6))).status()), "DRAINING");
  }
  timer.Stop();
}

TEST_F(SitePriorsTest, StaysWithinTheServersMemory) {
  store::MemoryStore store(256 << 20);
  telemetry::Log log = telemetry::Log::Silent();
  execution::Timer timer;
  MemoryAccount memory(int64_t{2} << 30);
  execution::PlanningPool pool(2, 8);
  {
    SessionRegistry registry({store,
                              pool,
                              timer,
                              log,
                              {},
                              Algorithms::Core(),
                              fixture::FixtureTime,
                              nullptr,
                              &memory,
                              fixture::SeenBy(fixture::FixtureTime)});
    const auto session = fixture::OpenSession(registry, "job");
    auto others = memory.Take("", (int64_t{2} << 30) - (int64_t{100} << 20));
    ASSERT_TRUE(others.has_value());
    EXPECT_EQ(contract::ReasonOf(Set(*session, Of(BoxObj(12, 9, 3))).status()), "MEMORY_SHORT");
    // What its reader takes counts, too: of a picture more than is left.
    others->Set((int64_t{2} << 30) - (int64_t{300} << 20));
    v1::SetSitePriorRequest picture = Of("\x89PNG\r\n\x1a\n");
    picture.mutable_site_prior()->set_unit_m(0.05);
    EXPECT_EQ(contract::ReasonOf(Set(*session, picture).status()), "MEMORY_SHORT");
    others->Set(int64_t{100} << 20);
    ASSERT_TRUE(Set(*session, Of(BoxObj(12, 9, 3))).ok());
    EXPECT_EQ(memory.used(), int64_t{100} << 20) << "what it took is given back";
    others->Set((int64_t{2} << 30) - (int64_t{20} << 20));
    const absl::Status now = Get(*session).status();
    EXPECT_EQ(contract::ReasonOf(now), "MEMORY_SHORT");
    EXPECT_TRUE(SaysWhenToRetry(now)) << "it passes";
    others->Release();
    ASSERT_TRUE(Get(*session).ok());
    const int64_t held = memory.used();
    EXPECT_GT(held, int64_t{1} << 20);
    EXPECT_EQ(session->model().site_prior().Forget(), held);
    EXPECT_EQ(memory.used(), 0);
    ASSERT_TRUE(Get(*session).ok());
    ASSERT_TRUE(Clear(*session).ok());
    EXPECT_EQ(memory.used(), 0);
  }
  timer.Stop();
}

// A host with so much memory for models and plans.
class SitePriorMemoryTest : public SitePriorsTest {
 protected:
  ~SitePriorMemoryTest() override {
    own_.reset();
    small_.reset();
    timer_.Stop();
  }
  Session& Begin(int64_t mebibytes, Algorithms algorithms = Algorithms::Core(),
                 contract::Limits limits = {}) {
    memory_.emplace(mebibytes << 20);
    small_ = std::make_unique<SessionRegistry>(SessionDependencies{
        own_store_, pool_of_jobs_, timer_, log_, limits, std::move(algorithms),
        fixture::FixtureTime, nullptr, &*memory_, fixture::SeenBy(fixture::FixtureTime)});
    own_ = fixture::OpenSession(*small_, "job");
    return *own_;
  }
  // The same sessions in a host with another amount.
  Session& Restart(int64_t mebibytes) {
    own_->WaitUntilIdle();
    own_.reset();
    small_.reset();
    memory_.emplace(mebibytes << 20);
    small_ = std::make_unique<SessionRegistry>(
        SessionDependencies{own_store_,
                            pool_of_jobs_,
                            timer_,
                            log_,
                            {},
                            Algorithms::Core(),
                            fixture::FixtureTime,
                            nullptr,
                            &*memory_,
                            fixture::SeenBy(fixture::FixtureTime)});
    EXPECT_TRUE(small_->LoadAll().ok());
    own_ = small_->Find("job").value();
    own_->WaitUntilIdle();
    return *own_;
  }

  UnsteadyStore own_store_;
  telemetry::Log log_ = telemetry::Log::Silent();
  execution::Timer timer_;
  // Before the pool, whose last jobs give back what they took.
  std::optional<MemoryAccount> memory_;
  execution::PlanningPool pool_of_jobs_{2, 8};
  std::unique_ptr<SessionRegistry> small_;
  std::shared_ptr<Session> own_;
};

// What can never fit is no shortage that passes: nobody is told to try again.
TEST_F(SitePriorMemoryTest, WhatNeverFitsIsRefusedForGood) {
  Session& session = Begin(160);
  const absl::Status large = Set(session, Of(BoxObj(60, 40, 3))).status();
  EXPECT_EQ(large.code(), absl::StatusCode::kResourceExhausted) << large;
  EXPECT_EQ(contract::ReasonOf(large), "FILE_TOO_LARGE");
  EXPECT_FALSE(SaysWhenToRetry(large));
  EXPECT_THAT(
      large.message(),
      testing::AllOf(HasSubstr("file: "), HasSubstr("the server has 160 MiB"),
                     HasSubstr("give the part that is to be scanned"), HasSubstr("--memory-mib")));
  // What its reader takes, of a picture, is more than there is.
  v1::SetSitePriorRequest picture = Of("\x89PNG\r\n\x1a\n");
  picture.mutable_site_prior()->set_unit_m(0.05);
  const absl::Status unread = Set(session, picture).status();
  EXPECT_EQ(contract::ReasonOf(unread), "FILE_TOO_LARGE");
  EXPECT_THAT(unread.message(), HasSubstr("a mesh instead of a plan"));
  EXPECT_EQ(memory_->used(), 0);
}

// One that was set where there was more memory: it is not used, and the job goes on without it.
TEST_F(SitePriorMemoryTest, WhatNeverFitsAnyMoreIsUnusableAndPlansGoOnWithoutIt) {
  {
    Session& session = Begin(4096);
    Scan(session);
    ASSERT_TRUE(Set(session, Of(BoxObj(60, 40, 3))).ok());
    session.WaitUntilIdle();
  }
  Session& session = Restart(160);
  for (int i = 0; i < 600 && session.model().Current().view == nullptr; ++i) {
    session.model().WhyNone().IgnoreError();
    absl::SleepFor(absl::Milliseconds(50));
  }
  const auto standing = Get(session);
  ASSERT_TRUE(standing.ok()) << standing.status();
  EXPECT_EQ(standing->standing().state(), v1::SITE_PRIOR_STATE_UNUSABLE);
  EXPECT_THAT(standing->standing().message(),
              testing::AllOf(HasSubstr("the prior is not used"), HasSubstr("--memory-mib")));
  const v1::Plan plan = Plan(session);
  EXPECT_EQ(plan.state(), v1::PLAN_STATE_SUCCEEDED) << plan.state_message();
}

// Nobody else's model goes for what nobody asked for.
TEST_F(SitePriorMemoryTest, WhatIsPreparedAheadTakesSpareMemoryOnly) {
  Session& session = Begin(2048);
  Scan(session);
  ASSERT_TRUE(Set(session, Request()).ok());
  ASSERT_TRUE(small_->WaitUntilIdle(std::chrono::seconds(60)));
  std::atomic<int> shortages{0};
  memory_->OnShortage([&](const MemoryAccount::Shortage&) { ++shortages; });
  session.model().prepared().Forget();
  session.model().site_prior().Forget();
  // What is left is enough for the plan, and not for its prior besides.
  const int64_t budget = memory_->budget();
  const int64_t left = budget / 8 + (int64_t{512} << 20);
  auto others = memory_->Take("", budget - memory_->used() - left);
  ASSERT_TRUE(others.has_value());
  shortages = 0;
  v1::CreatePlanRequest expected;
  absl::StatusOr<PlanInputs> inputs = ReadInputsOfPlan(session, session.model(), expected);
  ASSERT_TRUE(inputs.ok()) << inputs.status();
  ASSERT_TRUE(ReserveSpareMemory(session.model(), *inputs));
  others->Set(others->bytes() + (memory_->budget() - memory_->used()) - (int64_t{8} << 20));
  const auto ahead = SiteOf(session.model(), *inputs, {});
  EXPECT_EQ(contract::ReasonOf(ahead.status()), "MEMORY_SHORT");
  EXPECT_EQ(shortages, 0);
  // Who asks for it is given what others can do without.
  inputs->wanted = SitePriorUse::Wanted::kAsked;
  EXPECT_EQ(contract::ReasonOf(SiteOf(session.model(), *inputs, {}).status()), "MEMORY_SHORT");
  EXPECT_GT(shortages, 0);
  memory_->OnNoShortage();
}

// It is unfolded within the server's memory, also where it comes in an archive.
TEST_F(SitePriorMemoryTest, AnImportedPriorIsUnfoldedWithinTheServersMemory) {
  std::string large = BoxObj(4, 3, 2.6) + "v 1 1 0\nv 1.01 1 0\nv 1 1.01 0\n";
  for (int i = 0; i < 200'000; ++i) absl::StrAppend(&large, "f 9 10 11\n");
  const absl::Status set = Set(*session_, Of(large)).status();
  ASSERT_TRUE(set.ok()) << set;
  const std::string archive = Archive(session_);
  Begin(64);
  auto others = memory_->Take("", int64_t{62} << 20);
  const auto import = [&] {
    const auto imported = Import(*small_, archive);
    // Its model is loaded, and what that took given back.
    if (imported.ok()) small_->Find("copy").value()->WaitUntilIdle();
    return imported.status();
  };
  const absl::Status unread = import();
  EXPECT_EQ(contract::ReasonOf(unread), "MEMORY_SHORT") << unread;
  others->Release();
  EXPECT_TRUE(import().ok());
  EXPECT_LT(memory_->used(), 4096) << "but for an empty model";
}

// Nor is a plan told to try again that never fits beside the prior that it needs.
TEST_F(SitePriorMemoryTest, APlanThatNeverFitsBesideItIsTooLarge) {
  Session& session = Begin(1024);
  ASSERT_TRUE(Set(session, Of(BoxObj(12, 9, 3))).ok());
  std::optional<SitePriorQuestion> question;
  session.journal().Read([&](const SessionState& state) {
    question = SitePriorOf(state, session.origin(), own_store_);
  });
  const auto view = std::make_shared<model::PlanningView>(session.model().config().voxel_size, 0,
                                                          std::vector<model::BrickAt>(),
                                                          std::vector<model::Station>());
  using Asker = SitePriorUse::Asker;
  const absl::Status large =
      session.model()
          .site_prior()
          .Of(*question, view, Asker{SitePriorUse::Wanted::kAsked, int64_t{1020} << 20}, {})
          .status();
  EXPECT_EQ(contract::ReasonOf(large), "PLAN_TOO_LARGE") << large;
  EXPECT_FALSE(SaysWhenToRetry(large));
  const auto use = session.model().site_prior().Of(*question, view, Asker{}, {});
  ASSERT_TRUE(use.ok()) << use.status();
  EXPECT_EQ((*use)->standing.state, site_prior::PriorState::kPlaced) << "it is no verdict";
}

// All of what waits or is kept is counted.
TEST_F(SitePriorMemoryTest, WhatIsKeptIsCountedWhole) {
  Session& session = Begin(2048);
  ASSERT_TRUE(Set(session, Of(BoxObj(12, 9, 3))).ok());
  ASSERT_TRUE(Get(session).ok());
  const SitePriorQuestion question = [&] {
    std::optional<SitePriorQuestion> asked;
    session.journal().Read([&](const SessionState& state) {
      asked = SitePriorOf(state, session.origin(), own_store_);
    });
    return *asked;
  }();
  const auto use = session.model().site_prior().Last(question);
  ASSERT_NE(use, nullptr);
  ASSERT_NE(use->site, nullptr);
  const auto site = static_cast<int64_t>(site_prior::BytesOf(use->site->view()) +
                                         use->site->floors().size_bytes());
  EXPECT_GT(use->site->floors().size(), 10'000U) << "a column of voxels each";
  // What it was made from goes; what somebody plans with stays, and counts.
  EXPECT_GT(session.model().site_prior().Forget(), 12 * 9 * 2 * 400);
  EXPECT_EQ(memory_->used(), site);
}

// What somebody sends counts for the tenant's quota before it is stored.
TEST_F(SitePriorMemoryTest, IsStoredWithinTheTenantsQuota) {
  contract::Limits limits;
  limits.tenant_bytes = 32 << 10;
  Session& session = Begin(2048, Algorithms::Core(), limits);
  std::string detailed = BoxObj(4, 3, 2.6);
  for (int i = 0; i < 3000; ++i) {
    const double a = 1 + std::fmod(i * 0.6180339, 2.0);
    const double b = 1 + std::fmod(i * 0.7548776, 1.0);
    const double c = std::fmod(i * 0.5698402, 2.0);
    absl::StrAppend(&detailed, absl::StrFormat("v %.7f %.7f %.7f\nv %.7f %.7f %.7f\nv %.7f %.7f "
                                               "%.7f\nf -1 -2 -3\n",
                                               a, b, c, a + 0.01, b, c, a, b + 0.01, c));
  }
  const absl::Status full = Set(session, Of(detailed)).status();
  EXPECT_EQ(full.code(), absl::StatusCode::kResourceExhausted) << full;
  EXPECT_EQ(contract::ReasonOf(full), "QUOTA_EXCEEDED");
  EXPECT_EQ(BlobOf(session), "");
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(Set(session, Of(BoxObj(4 + i, 3, 2.6))).ok()) << "one in place of the other";
  }
}

// A tour that never fits, either, says what helps; one that has ended is in nobody's way.
TEST_F(SitePriorMemoryTest, ToursThatNeverFitAreRefusedForGoodAndThoseThatEndedAreOver) {
  contract::Limits limits;
  limits.running_plans_per_session = 1;
  limits.evaluations = 1;
  Session& session = Begin(640, Algorithms::Core(), limits);
  Scan(session);
  v1::CreateTourRequest request;
  request.set_parent("sessions/job");
  request.mutable_wish()->set_work_limit_rays(200'000);
  const absl::Status large = session.tours().Create(request).status();
  EXPECT_EQ(contract::ReasonOf(large), "PLAN_TOO_LARGE") << large;
  EXPECT_FALSE(SaysWhenToRetry(large));
  EXPECT_THAT(large.message(), HasSubstr("wish.max_candidate_count"));
  request.mutable_wish()->set_max_candidate_count(20);
  std::vector<std::shared_ptr<TourRun>> held;
  for (int i = 0; i < 2; ++i) {
    const auto run = session.tours().Create(request);
    ASSERT_TRUE(run.ok()) << run.status();
    for (int k = 0; k < 3000 && !(*run)->Ended(); ++k) absl::SleepFor(absl::Milliseconds(10));
    const TourRun::News news = (*run)->Take();
    EXPECT_TRUE(news.status.ok()) << news.status;
    EXPECT_TRUE(news.tour.has_value());
    EXPECT_FALSE(session.model().InUse()) << "who is told that it ended may ask for the next";
    held.push_back(*run);
  }
}

// However its work ends, the session has its place for another.
TEST_F(SitePriorMemoryTest, AnEvaluationEndsWhateverIsThrown) {
  Evaluations evaluations;
  std::shared_ptr<Evaluation> one = evaluations.Begin(1);
  ASSERT_NE(one, nullptr);
  EXPECT_EQ(evaluations.Begin(1), nullptr);
  one->End();
  one->End();  // once
  EXPECT_FALSE(evaluations.any());
  EXPECT_THROW(
      {
        const auto held = evaluations.Begin(1);
        throw std::bad_alloc();
      },
      std::bad_alloc);
  EXPECT_FALSE(evaluations.any());

  // Who is answered may ask for the next at once.
  bool rests = false;
  absl::Status told;
  const auto done = [&](const absl::StatusOr<int>& answer) {
    rests = !evaluations.any();
    told = answer.status();
  };
  {
    AskedEvaluation<int> asked(*session_, evaluations.Begin(1), done);
    asked.Answer([]() -> absl::StatusOr<int> { throw std::bad_alloc(); });
  }
  EXPECT_TRUE(rests);
  EXPECT_EQ(contract::ReasonOf(told), "MEMORY_SHORT");
  { const AskedEvaluation<int> dropped(*session_, evaluations.Begin(1), done); }
  EXPECT_TRUE(rests);
  EXPECT_EQ(contract::ReasonOf(told), "DRAINING");
  EXPECT_THROW(
      {
        const AskedEvaluation<int> asked(*session_, evaluations.Begin(1), done);
        throw std::bad_alloc();
      },
      std::bad_alloc);
  EXPECT_EQ(contract::ReasonOf(told), "MEMORY_SHORT");
  EXPECT_FALSE(evaluations.any());
}

}  // namespace
}  // namespace vantage::session
