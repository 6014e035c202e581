// Scans of a scanner that did not stand upright: who sent them is told so.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <chrono>
#include <string>
#include <thread>

#include "core/parallel/parallel.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "server/conversion/to_proto.h"
#include "tests/server/fixture/in_process.h"

namespace vantage::rpc {
namespace {

using ::testing::HasSubstr;

// A room in which one wall is as near as the floor.
class TiltedScanRpc : public testing::Test {
 protected:
  TiltedScanRpc() { scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.5); }

  // Tilted by `degrees` from upright, its +z towards the wall at x = 0 if these are 90.
  static Eigen::Isometry3d At(const Eigen::Vector3d& place, double degrees) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = place;
    pose.linear() =
        Eigen::AngleAxisd(-sensor::Radians(degrees), Eigen::Vector3d::UnitY()).toRotationMatrix();
    return pose;
  }
  v1::Upload Send(const Eigen::Isometry3d& pose, const v1::PosePrior* prior = nullptr) {
    parallel::Serial serial;
    return server_.Send(
        session_, sensor::EncodeRangeImage(simulated_.Scan(scanner_, pose, {}, 3, serial)), prior);
  }
  v1::Scan SendFirst(const Eigen::Isometry3d& pose, const v1::PosePrior* prior = nullptr) {
    return server_.WaitFor(session_, Send(pose, prior).scan(), v1::SCAN_STATE_MERGED);
  }

  sensor::ScannerModel scanner_;
  const simulation::Scene room_ = simulation::BoxRoom({5.5, 4, 2.6});
  const simulation::SimulatedScanner simulated_{room_.mesh};
  fixture::InProcess server_{session::Algorithms::Core()};
  const std::string session_ = server_.OpenSession("job");
};

TEST_F(TiltedScanRpc, AnUprightOneIsToldNothing) {
  const v1::Scan scan = SendFirst(At({3.8, 2.1, 1.4}, 3));
  EXPECT_TRUE(scan.levelling().found_floor());
  EXPECT_EQ(scan.levelling().message(), "");
}

// Its wall, 1.7 m from it, would do as a floor.
TEST_F(TiltedScanRpc, TheFirstOfAScannerOnItsSideIsToldSoAndWhatToDo) {
  const v1::Scan scan = SendFirst(At({3.8, 2.1, 1.4}, 90));
  EXPECT_TRUE(scan.levelling().found_floor());
  EXPECT_THAT(scan.levelling().message(),
              testing::AllOf(HasSubstr("1.7 m below the scanner, may be a wall"),
                             HasSubstr("withdraw the scan")));
}

TEST_F(TiltedScanRpc, BeyondWhatTheFloorCorrectsItIsToldWhatWasAssumed) {
  EXPECT_THAT(SendFirst(At({3.8, 2.1, 1.4}, 40)).levelling().message(),
              HasSubstr("taken to have stood upright"));
}

TEST_F(TiltedScanRpc, WhereAnInclinometerSaysThatItLayOnItsSideNothingIsGuessed) {
  v1::PosePrior prior;
  const Eigen::Isometry3d pose = At({0, 0, 0}, 90);
  *prior.mutable_pose() = conversion::WritePose(pose, Eigen::Vector3d::Zero());
  prior.set_levelled_sigma_rad(0.001);
  const v1::Scan scan = SendFirst(At({3.8, 2.1, 1.4}, 90), &prior);
  EXPECT_NEAR(scan.levelling().tilt_rad(), sensor::Radians(90), 1e-6);
  EXPECT_THAT(scan.levelling().message(), HasSubstr("was tilted by 90 degrees"));
}

// There is a model to align it to, and places are looked for upright.
TEST_F(TiltedScanRpc, ALaterOneThatDoesNotRegisterIsToldThatThisMayBeWhy) {
  SendFirst(At({3.8, 2.1, 1.4}, 0));
  const v1::Upload upload = Send(At({3.6, 1.9, 1.4}, 90));
  v1::GetScanRequest request;
  request.set_name(upload.scan());
  v1::GetScanResponse response;
  for (int tries = 0; tries < 3000 && response.scan().state_message().empty(); ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    grpc::ClientContext context;
    ASSERT_TRUE(server_.scans->GetScan(&context, request, &response).ok());
    ASSERT_NE(response.scan().state(), v1::SCAN_STATE_MERGED);
  }
  EXPECT_THAT(response.scan().state_message(), HasSubstr("may have lain on its side"));
}

}  // namespace
}  // namespace vantage::rpc
