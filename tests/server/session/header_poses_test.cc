// Poses in the headers of scans' files that are wrong, as a session deals with them: found, said,
// and the search tried.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>

#include "core/sensor/encoding.h"
#include "server/conversion/to_proto.h"
#include "server/store/memory_store.h"
#include "tests/core/registration/box_scene.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using testing::HasSubstr;
using testing::Not;

class HeaderPosesTest : public testing::Test {
 protected:
  HeaderPosesTest() : session_(fixture::OpenSession(host_.registry, "job")) {
    Send(registration::PoseAt({-1.0, -0.6, 1.4}, 0.3),
         registration::PoseAt({-1.0, -0.6, 1.4}, 0.3));
  }
  // A scan made at `truth` whose file states `header`.
  v1::Scan Send(const Eigen::Isometry3d& truth, const Eigen::Isometry3d& header) {
    v1::PosePrior prior;
    *prior.mutable_pose() = conversion::WritePose(header, Eigen::Vector3d::Zero());
    prior.set_source(v1::POSE_PRIOR_SOURCE_FILE_HEADER);
    const auto upload = fixture::SendScan(
        *session_,
        sensor::EncodeRangeImage(registration::ScanScene(room_, truth, {}, ++seed_).image), &prior);
    EXPECT_TRUE(upload.ok()) << upload.status();
    session_->WaitUntilIdle();
    return session_->scans().Get(upload->scan()).value();
  }
  void Accept(const v1::Scan& scan) {
    ASSERT_TRUE(session_->scans().Accept(scan.name(), {0, false, scan.etag()}, {}).ok());
    session_->WaitUntilIdle();
  }
  static double OffOf(const v1::Pose& pose, const Eigen::Isometry3d& truth) {
    return (conversion::ReadOwnVector(pose.translation()) - truth.translation()).norm();
  }

  const registration::BoxScene room_ = registration::FurnishedRoom(3);
  // Where the second scan was made, and the third; and how the headers of both are off.
  const Eigen::Isometry3d second_ = registration::PoseAt({0.9, 0.1, 1.5}, 2.1);
  const Eigen::Isometry3d third_ = registration::PoseAt({-0.2, 1.1, 1.4}, -0.8);
  const Eigen::Isometry3d frame_ =
      Eigen::Translation3d(40, -25, 0.4) * Eigen::AngleAxisd(1.9, Eigen::Vector3d::UnitZ());
  store::MemoryStore store_{size_t{256} << 20};
  fixture::SessionHost host_{store_, Algorithms::Core()};
  std::shared_ptr<Session> session_;
  unsigned seed_ = 20;
};

TEST_F(HeaderPosesTest, OneThatIsWrongIsFoundAndSaidAndTheSearchTried) {
  const v1::Scan scan = Send(second_, frame_ * second_);
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_DOUBTFUL) << "it may be of a place that looks the same";
  EXPECT_THAT(scan.state_message(), HasSubstr("the pose in the file's header"));
  EXPECT_THAT(scan.state_message(), HasSubstr("off what the surfaces say"));
  EXPECT_THAT(scan.state_message(), HasSubstr("accept it if it was made there"));
  EXPECT_LT(OffOf(scan.registration().pose(), second_), 0.005) << "where the search found it";
  EXPECT_EQ(scan.registration().verdict().basis(), v1::REGISTRATION_BASIS_NO_POSE_PRIOR);
  Accept(scan);
  EXPECT_LT(OffOf(session_->scans().Get(scan.name())->pose(), second_), 0.005);
}

// Once somebody has said where one was made, headers in the same frame lead to the others.
TEST_F(HeaderPosesTest, TheNextInTheSameFrameRegistersByIt) {
  const v1::Scan scan = Send(second_, frame_ * second_);
  Accept(scan);
  const v1::Scan next = Send(third_, frame_ * third_);
  EXPECT_EQ(next.state(), v1::SCAN_STATE_MERGED) << next.state_message();
  EXPECT_EQ(next.pose_source(), v1::POSE_SOURCE_REGISTRATION);
  EXPECT_LT(OffOf(next.pose(), third_), 0.005);
}

// The frame goes with the scan that showed it.
TEST_F(HeaderPosesTest, WithoutTheScanThatShowedTheFrameItIsInDoubtAgain) {
  const v1::Scan scan = Send(second_, frame_ * second_);
  Accept(scan);
  ASSERT_TRUE(session_->scans().Withdraw(scan.name(), {}).ok());
  session_->WaitUntilIdle();
  const v1::Scan next = Send(third_, frame_ * third_);
  EXPECT_EQ(next.state(), v1::SCAN_STATE_DOUBTFUL);
  EXPECT_THAT(next.state_message(), HasSubstr("the pose in the file's header"));
}

// As files are written without a registration: each states the same pose.
TEST_F(HeaderPosesTest, OneThatRepeatsThatOfAnotherScanSaysNothing) {
  const Eigen::Isometry3d first = registration::PoseAt({-1.0, -0.6, 1.4}, 0.3);
  const v1::Scan scan = Send(third_, first);
  EXPECT_THAT(scan.state_message(), Not(HasSubstr("header")));
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_MERGED) << scan.state_message();
  EXPECT_LT(OffOf(scan.pose(), third_), 0.005) << "where the search found it";
}

}  // namespace
}  // namespace vantage::session
