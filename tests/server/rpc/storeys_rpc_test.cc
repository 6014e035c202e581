// Storeys, and floor that was measured, on the wire: scenes with edges are scanned, sent and
// planned in through the API, and every view that comes back is judged on the scene's mesh.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/edge_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "server/conversion/to_proto.h"
#include "tests/server/fixture/in_process.h"
#include "tests/support/standing_oracle.h"

namespace vantage::rpc {
namespace {

constexpr double kSameFloor = 0.1;  // m; what is measured of a floor lies this near to it
constexpr double kFootAway = 0.25;  // m, of a tripod's feet from its middle
constexpr double kSunken = 0.5;     // m; floor this little below a storey belongs to it

// The heights of a scene's storeys, m, as its builder made them, from the lowest up: where most of
// their level floor lies. None where too little of it is level to tell.
struct StoreyedScene {
  const char* name;
  std::vector<double> storeys;
};
const StoreyedScene kScenes[] = {{"two storeys", {0, 2.8}},
                                 {"platform", {-3, 0}},
                                 {"mezzanine", {0, 2.8}},
                                 {"stairs up", {0}},
                                 {"pit", {0}},
                                 {"house", {0, 2.8}},
                                 {"glass balustrade", {-3, 0}},
                                 {"atrium", {0, 2.8}},
                                 {"stairwell edge", {-2.7, 0}},
                                 {"stairs down", {0}},
                                 {"ramp", {}},
                                 {"step", {0.17}}};

Eigen::Vector3d PlaceOf(const v1::RankedView& view) {
  return conversion::ReadOwnVector(view.position());
}

class StoreysRpc : public testing::Test {
 protected:
  StoreysRpc() { scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4); }

  void Open(const std::string& name) {
    const std::vector<simulation::Scene> scenes = simulation::EdgeScenes();
    scene_ = *std::find_if(scenes.begin(), scenes.end(),
                           [&](const simulation::Scene& scene) { return scene.name == name; });
    storeyed_ = *std::find_if(std::begin(kScenes), std::end(kScenes),
                              [&](const StoreyedScene& scene) { return scene.name == name; });
    v1::CreateSessionRequest request;
    v1::ScannerModel& model = *request.mutable_session()->add_scanner_models();
    model.set_azimuth_step_rad(scanner_.azimuth_step);
    model.set_elevation_step_rad(scanner_.elevation_step);
    grpc::ClientContext context;
    v1::CreateSessionResponse response;
    ASSERT_TRUE(server_.sessions->CreateSession(&context, request, &response).ok());
    session_ = response.session().name();
    for (size_t i = 0; i < scene_.starts.size(); ++i) Scan(i);
  }

  // A scan from one of the scene's starts. A person sets its pose where it does not register, as
  // between storeys that have no way between them.
  void Scan(size_t start) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = scene_.starts[start];
    const simulation::SimulatedScanner simulated(scene_.mesh);
    v1::PosePrior prior;
    *prior.mutable_pose() = conversion::WritePose(pose, Eigen::Vector3d::Zero());
    prior.set_levelled_sigma_rad(0.0005);  // or a ramp would be taken for level floor
    const v1::Upload upload =
        server_.Send(session_,
                     sensor::EncodeRangeImage(simulated.Scan(
                         scanner_, pose, simulation::ScanFaults{}, 7 + start, pool_)),
                     &prior);
    v1::GetScanRequest request;
    request.set_name(upload.scan());
    v1::GetScanResponse response;
    for (int tries = 0; tries < 3000; ++tries) {
      grpc::ClientContext context;
      ASSERT_TRUE(server_.scans->GetScan(&context, request, &response).ok());
      const v1::ScanState state = response.scan().state();
      if (state == v1::SCAN_STATE_MERGED) return;
      if (state == v1::SCAN_STATE_DOUBTFUL || state == v1::SCAN_STATE_FAILED) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    v1::SetScanPoseRequest set;
    set.set_name(upload.scan());
    *set.mutable_prior() = prior;
    set.set_use(v1::POSE_USE_AS_IS);
    v1::SetScanPoseResponse done;
    grpc::ClientContext context;
    ASSERT_TRUE(server_.scans->SetScanPose(&context, set, &done).ok());
    server_.WaitFor(session_, upload.scan(), v1::SCAN_STATE_MERGED);
  }

  v1::PlanResult Plan() {
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    request.mutable_plan()->set_work_limit_rays(5'000'000);
    request.mutable_plan()->mutable_config_overrides()->set_max_view_count(40);
    return server_.Plan(request, [this](const v1::Plan& plan) { Judge(plan.result()); }).result();
  }

  v1::EvaluateViewResponse Evaluate(const Eigen::Vector3d& place) {
    v1::EvaluateViewRequest request;
    request.set_parent(session_);
    *request.mutable_position() = conversion::WriteVector(place);
    v1::EvaluateViewResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(server_.plans->EvaluateView(&context, request, &response).ok());
    return response;
  }

  v1::GetCoverageResponse Coverage() {
    v1::GetCoverageRequest request;
    request.set_name(session_);
    v1::GetCoverageResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(server_.models->GetCoverage(&context, request, &response).ok());
    return response;
  }

  // The storey that the mesh has below a place, as its builder meant it.
  double StoreyBelow(const Eigen::Vector3d& place) const {
    const double floor = test_support::MeshFloor(scene_).Below(place).value_or(1e9);
    double below = storeyed_.storeys.empty() ? 0 : storeyed_.storeys.front();
    for (const double storey : storeyed_.storeys) {
      if (storey <= floor + kSunken) below = storey;
    }
    return below;
  }

  void Judge(const v1::PlanResult& result) {
    for (const auto* views : {&result.views(), &result.refused()}) {
      for (const v1::RankedView& view : *views) {
        Judge(view);
        // A plan says of its storeys what its views say.
        const auto own = std::find_if(
            result.storeys().begin(), result.storeys().end(),
            [&](const v1::Storey& storey) { return storey.number() == view.storey().number(); });
        ASSERT_NE(own, result.storeys().end());
        EXPECT_EQ(own->SerializeAsString(), view.storey().SerializeAsString());
        if (view.has_location()) JudgeWords(view, result.storeys_size() > 1);
      }
    }
  }
  void Judge(const v1::RankedView& view) {
    SCOPED_TRACE(view.position().ShortDebugString());
    const test_support::MeshFloor mesh(scene_);
    EXPECT_TRUE(mesh.Carries(PlaceOf(view), view.height_over_floor_m())) << "in the air";
    EXPECT_TRUE(mesh.CarriesTripod(PlaceOf(view), kFootAway)) << "a foot in the air";
    ASSERT_TRUE(view.has_storey());
    EXPECT_TRUE(view.has_floor_measured());
    ASSERT_EQ(view.storey().has_floor_z_m(), !storeyed_.storeys.empty());
    if (storeyed_.storeys.empty()) return;
    EXPECT_NEAR(view.storey().floor_z_m(), StoreyBelow(PlaceOf(view)), kSameFloor);
  }
  static void JudgeWords(const v1::RankedView& view, bool several) {
    const std::string& words = view.location().description();
    const std::string storey = "on storey " + std::to_string(view.storey().number());
    EXPECT_EQ(words.find(storey) != std::string::npos, several) << words;
    EXPECT_EQ(words.find("floor below was not measured") != std::string::npos,
              !view.floor_measured())
        << words;
  }

  sensor::ScannerModel scanner_;
  parallel::ThreadPool pool_{2};
  fixture::InProcess server_{session::Algorithms::Core()};
  simulation::Scene scene_;
  StoreyedScene storeyed_;
  std::string session_;
};

class StoreyedSceneTest : public StoreysRpc, public testing::WithParamInterface<size_t> {};

TEST_P(StoreyedSceneTest, EveryViewStandsOnTheFloorOfTheStoreyThatItNames) {
  ASSERT_NO_FATAL_FAILURE(Open(kScenes[GetParam()].name));
  SCOPED_TRACE(scene_.name);
  const v1::PlanResult result = Plan();
  EXPECT_GT(result.views_size() + result.refused_size(), 5);
  Judge(result);

  const v1::GetCoverageResponse coverage = Coverage();
  ASSERT_EQ(coverage.storeys_size(), result.storeys_size());
  for (int k = 0; k < coverage.storeys_size(); ++k) {
    EXPECT_EQ(coverage.storeys(k).number(), k);
    EXPECT_EQ(coverage.storeys(k).SerializeAsString(), result.storeys(k).SerializeAsString());
  }
  // What-ifs where the scans were made, whose storeys are known, then.
  for (const Eigen::Vector3d& start : scene_.starts) {
    const v1::EvaluateViewResponse here = Evaluate(start);
    Judge(here.view());
    JudgeWords(here.view(), coverage.storeys_size() > 1);
    if (storeyed_.storeys.empty()) continue;
    EXPECT_TRUE(std::any_of(coverage.storeys().begin(), coverage.storeys().end(),
                            [&](const v1::Storey& storey) {
                              return std::abs(storey.floor_z_m() - StoreyBelow(start)) < kSameFloor;
                            }));
  }
  // Out of the scene nothing is below.
  const v1::RankedView nowhere = Evaluate({100, 100, 1.5}).view();
  EXPECT_FALSE(nowhere.has_storey());
  EXPECT_FALSE(nowhere.has_floor_measured());
  EXPECT_THAT(nowhere.location().description(), testing::HasSubstr("no floor is known below"));
}
INSTANTIATE_TEST_SUITE_P(Scenes, StoreyedSceneTest, testing::Range(size_t{0}, std::size(kScenes)));

// Requirements can change during a job: what was asked of the whole site is asked of one storey.
TEST_F(StoreysRpc, RegionsAndNamesThatComeLaterCountFromThenOn) {
  ASSERT_NO_FATAL_FAILURE(Open("two storeys"));
  const v1::Coverage before = Coverage().coverage();
  EXPECT_EQ(before.regions_size(), 0);
  v1::UpdateSessionRequest update;
  update.mutable_session()->set_name(session_);
  update.mutable_update_mask()->add_paths("site_rules");
  v1::SiteRules& rules = *update.mutable_session()->mutable_site_rules();
  for (const auto& [name, z] : {std::pair("shop", 0.0), {"flat", 2.8}}) {
    v1::NamedStorey& storey = *rules.add_storeys();
    storey.set_name(name);
    storey.set_floor_z_m(z);
    v1::RequiredRegion& region = *rules.add_regions();
    region.set_name(std::string("all of the ") + name);
    region.set_storey(name);
    for (const auto& [x, y] : {std::pair(-1, -1), {7, -1}, {7, 6}, {-1, 6}}) {
      v1::Vector3& corner = *region.mutable_polygon()->add_corners();
      corner.set_x(x);
      corner.set_y(y);
    }
  }
  rules.mutable_regions(0)->set_weight(0);
  rules.mutable_regions(1)->set_required_density_per_m2(100);
  v1::UpdateSessionResponse updated;
  grpc::ClientContext context;
  const grpc::Status status = server_.sessions->UpdateSession(&context, update, &updated);
  ASSERT_TRUE(status.ok()) << status.error_message();

  const v1::GetCoverageResponse after = Coverage();
  ASSERT_EQ(after.coverage().regions_size(), 2);
  EXPECT_EQ(after.coverage().regions(0).name(), "all of the shop");
  EXPECT_EQ(after.coverage().regions(0).area_by_kind_m2().true_surface(), 0);
  EXPECT_EQ(after.coverage().regions(1).required_density_per_m2(), 100);
  // Nothing but the upper storey counts, where a coarse scan is enough.
  EXPECT_NEAR(after.coverage().regions(1).area_by_kind_m2().true_surface(),
              after.coverage().area_by_kind_m2().true_surface(), 0.3);
  EXPECT_LT(after.coverage().area_by_kind_m2().true_surface(),
            0.7 * before.area_by_kind_m2().true_surface());
  EXPECT_GT(after.coverage().estimated_coverage(), before.estimated_coverage() + 0.1);
  ASSERT_EQ(after.storeys_size(), 2);
  EXPECT_EQ(after.storeys(0).name(), "shop");
  EXPECT_EQ(after.storeys(1).name(), "flat");

  const v1::PlanResult plan = Plan();
  ASSERT_GT(plan.views_size() + plan.refused_size(), 0);
  EXPECT_EQ(plan.coverage().regions_size(), 2);
  EXPECT_EQ(plan.storeys(1).name(), "flat");
  const v1::RankedView& best = plan.views_size() > 0 ? plan.views(0) : plan.refused(0);
  EXPECT_EQ(best.storey().name(), "flat");  // nothing is asked for below
  EXPECT_THAT(best.location().description(), testing::HasSubstr("on storey 1 (flat)"));

  // A region that is impossible changes nothing.
  rules.mutable_regions(1)->set_storey("cellar");
  grpc::ClientContext again;
  EXPECT_THAT(fixture::ViolatedFields(server_.sessions->UpdateSession(&again, update, &updated)),
              testing::Contains("session.site_rules.regions[1].storey"));
  EXPECT_EQ(Coverage().coverage().SerializeAsString(), after.coverage().SerializeAsString());
}

TEST_F(StoreysRpc, WhatIsFreeInsteadOfAClaimedViewNamesItsStorey) {
  ASSERT_NO_FATAL_FAILURE(Open("two storeys"));
  for (const char* id : {"a", "b"}) {
    v1::CreateScannerRequest request;
    request.set_parent(session_);
    request.set_scanner_id(id);
    request.mutable_scanner();
    v1::CreateScannerResponse response;
    grpc::ClientContext context;
    ASSERT_TRUE(server_.fleet->CreateScanner(&context, request, &response).ok());
  }
  grpc::Status status;
  for (const char* id : {"a", "b"}) {
    v1::ClaimViewRequest request;
    request.set_parent(session_);
    request.set_scanner(session_ + "/scanners/" + id);
    *request.mutable_position() = conversion::WriteVector({3.55, 2.55, 2.8 + 1.55});
    v1::ClaimViewResponse response;
    grpc::ClientContext context;
    status = server_.fleet->ClaimView(&context, request, &response);
    EXPECT_EQ(status.ok(), id[0] == 'a') << status.error_message();
  }
  v1::ClaimConflict conflict;
  for (const google::protobuf::Any& any : fixture::Details(status)) any.UnpackTo(&conflict);
  ASSERT_TRUE(conflict.has_alternative()) << conflict.no_alternative_message();
  const v1::ClaimAlternative& free = conflict.alternative();
  ASSERT_TRUE(free.has_storey());
  EXPECT_TRUE(free.has_floor_measured());
  EXPECT_NEAR(free.storey().floor_z_m(), StoreyBelow(conversion::ReadOwnVector(free.position())),
              kSameFloor);
}

}  // namespace
}  // namespace vantage::rpc
