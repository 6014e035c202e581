// A room behind a door that is too narrow for the scanner, on the wire: scanned, sent and planned
// in through the API.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"
#include "server/conversion/to_proto.h"
#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

using Eigen::Vector3d;

constexpr double kWall = 4.0;   // m, x of the wall between the two rooms
constexpr double kThick = 0.2;  // m
constexpr double kDoor = 0.5;   // m, as wide as the door in it

// Two rooms of 4 x 4 m.
simulation::TriangleMesh TwoRooms() {
  simulation::TriangleMesh mesh;
  simulation::MeshBuilder builder(mesh);
  const double length = 2 * kWall + kThick;
  const auto box = [&](const Vector3d& low, const Vector3d& high) { builder.Box(low, high); };
  box({-0.2, -0.2, -0.2}, {length + 0.2, 4.2, 0});
  box({-0.2, -0.2, 2.6}, {length + 0.2, 4.2, 2.8});
  box({-0.2, -0.2, 0}, {0, 4.2, 2.6});
  box({length, -0.2, 0}, {length + 0.2, 4.2, 2.6});
  box({0, -0.2, 0}, {length, 0, 2.6});
  box({0, 4, 0}, {length, 4.2, 2.6});
  box({kWall, 0, 0}, {kWall + kThick, 2 - kDoor / 2, 2.6});
  box({kWall, 2 + kDoor / 2, 0}, {kWall + kThick, 4, 2.6});
  box({kWall, 2 - kDoor / 2, 2.05}, {kWall + kThick, 2 + kDoor / 2, 2.6});
  return mesh;
}

class NarrowWaysRpc : public testing::Test {
 protected:
  NarrowWaysRpc() {
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.4);
    v1::CreateSessionRequest request;
    v1::ScannerModel& model = *request.mutable_session()->add_scanner_models();
    model.set_azimuth_step_rad(scanner_.azimuth_step);
    model.set_elevation_step_rad(scanner_.elevation_step);
    grpc::ClientContext context;
    v1::CreateSessionResponse response;
    EXPECT_TRUE(server_.sessions->CreateSession(&context, request, &response).ok());
    session_ = response.session().name();
    // All of the first room is at density then, and much of the second was seen.
    for (const Vector3d& position :
         {Vector3d(2, 2, 1.5), Vector3d(3.3, 1.5, 1.5), Vector3d(3.3, 2.5, 1.5)}) {
      Scan(position);
    }
  }

  void Scan(const Vector3d& position) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = position;
    v1::PosePrior prior;
    *prior.mutable_pose() = conversion::WritePose(pose, Vector3d::Zero());
    prior.set_levelled_sigma_rad(0.0005);
    const v1::Upload upload =
        server_.Send(session_,
                     sensor::EncodeRangeImage(simulated_.Scan(
                         scanner_, pose, simulation::ScanFaults{}, ++scans_, pool_)),
                     &prior);
    server_.WaitFor(session_, upload.scan(), v1::SCAN_STATE_MERGED);
  }

  v1::PlanResult Plan() {
    v1::CreatePlanRequest request;
    request.set_parent(session_);
    request.mutable_plan()->set_work_limit_rays(20'000'000);
    return server_.Plan(request).result();
  }

  void SetWidth(double width) {
    v1::UpdateSessionRequest update;
    update.mutable_session()->set_name(session_);
    update.mutable_session()->mutable_planning_config()->set_scanner_width_m(width);
    update.mutable_update_mask()->add_paths("planning_config.scanner_width_m");
    v1::UpdateSessionResponse updated;
    grpc::ClientContext context;
    const grpc::Status status = server_.sessions->UpdateSession(&context, update, &updated);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }

  void Claim(const std::string& scanner, const v1::Vector3& position) {
    v1::CreateScannerRequest create;
    create.set_parent(session_);
    create.set_scanner_id(scanner);
    create.mutable_scanner();
    v1::CreateScannerResponse created;
    grpc::ClientContext context;
    ASSERT_TRUE(server_.fleet->CreateScanner(&context, create, &created).ok());
    v1::ClaimViewRequest request;
    request.set_parent(session_);
    request.set_scanner(created.scanner().name());
    *request.mutable_position() = position;
    v1::ClaimViewResponse response;
    grpc::ClientContext claiming;
    const grpc::Status status = server_.fleet->ClaimView(&claiming, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }

  static int Behind(const v1::PlanResult& result) {
    int behind = 0;
    for (const v1::RankedView& view : result.views()) {
      behind += view.position().x() > kWall + kThick ? 1 : 0;
    }
    return behind;
  }

  const simulation::TriangleMesh mesh_ = TwoRooms();
  const simulation::SimulatedScanner simulated_{mesh_};
  sensor::ScannerModel scanner_;
  parallel::ThreadPool pool_{2};
  fixture::InProcess server_{session::Algorithms::Core()};
  std::string session_;
  uint64_t scans_ = 0;
};

TEST_F(NarrowWaysRpc, TheWidthThatAPlanSaysOpensTheRoom) {
  const v1::PlanResult shut = Plan();
  EXPECT_EQ(Behind(shut), 0);
  ASSERT_GT(shut.narrow_ways_size(), 0) << shut.message();
  const v1::NarrowWay& way = shut.narrow_ways(0);
  EXPECT_GT(way.position().x(), kWall + kThick);
  EXPECT_NEAR(way.narrowest().x(), kWall + kThick / 2, 0.3);
  EXPECT_LE(way.width_m(), kDoor);
  EXPECT_THAT(way.message(),
              testing::HasSubstr(absl::StrFormat("set scanner_width_m to %.2f if", way.width_m())));

  SetWidth(way.width_m());
  const v1::PlanResult open = Plan();
  EXPECT_GT(Behind(open), 0) << open.message();
}

// With a claim, plans are joint ones.
TEST_F(NarrowWaysRpc, ItIsSaidBesideClaimsOfWhatTheyLeave) {
  const v1::PlanResult before = Plan();
  ASSERT_GT(before.narrow_ways_size(), 0);
  // In the first room, from where little of the second is seen.
  ASSERT_NO_FATAL_FAILURE(Claim("near", conversion::WriteVector({1, 1, 1.5})));
  const v1::PlanResult beside = Plan();
  ASSERT_EQ(beside.joint().claims_size(), 1);
  ASSERT_GT(beside.narrow_ways_size(), 0) << beside.message();
  EXPECT_EQ(beside.narrow_ways(0).width_m(), before.narrow_ways(0).width_m());
  EXPECT_GT(beside.narrow_ways(0).expected_gain_m2(),
            0.8 * before.narrow_ways(0).expected_gain_m2());
  // Where the plan would send a narrower scanner somebody else goes.
  ASSERT_NO_FATAL_FAILURE(Claim("narrow", beside.narrow_ways(0).position()));
  const v1::PlanResult left = Plan();
  ASSERT_EQ(left.joint().claims_size(), 2);
  for (const v1::NarrowWay& way : left.narrow_ways()) {
    EXPECT_LT(way.expected_gain_m2(), 0.5 * beside.narrow_ways(0).expected_gain_m2());
  }
}

}  // namespace
}  // namespace vantage::rpc
