// Poses in a national grid, to a job that nobody told of it.
#include "server/session/session_origin.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/store/memory_store.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

const Eigen::Vector3d kCorner(691'412.25, 5'335'120.5, 520.75);  // of the room, UTM, with altitude
const Eigen::Vector3d kFirst(2.0, 1.5, 1.4);                     // in the room
const Eigen::Vector3d kSecond(3.0, 2.5, 1.4);

v1::Upload At(const Eigen::Vector3d& place) {
  v1::Upload upload;
  *upload.mutable_prior() = fixture::PriorAt(place.x(), place.y(), place.z());
  return upload;
}

class SessionOriginTest : public testing::Test {
 protected:
  SessionOriginTest() {
    script_.EndPlans();
    Start();
    session_ = fixture::OpenSession(host_->registry, "job");
  }
  void Start() { host_ = std::make_unique<fixture::SessionHost>(store_, script_.Make()); }
  v1::Scan Send(const Eigen::Vector3d& in_room, const Eigen::Vector3d& place) {
    const auto upload =
        fixture::SendDescribed(*session_, fixture::EncodedRoom(in_room, 2.0), At(place));
    EXPECT_TRUE(upload.ok()) << upload.status();
    if (!upload.ok()) return {};
    session_->WaitUntilIdle();
    return session_->scans().Get(upload->scan()).value();
  }

  store::MemoryStore store_{64 << 20};
  fixture::Script script_;
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
};

TEST_F(SessionOriginTest, IsWhereTheFirstScanWasMade) {
  EXPECT_FALSE(session_->Describe().has_origin());
  const v1::Scan first = Send(kFirst, kCorner + kFirst);
  ASSERT_EQ(first.state(), v1::SCAN_STATE_MERGED) << first.state_message();
  const v1::Vector3 origin = session_->Describe().origin();
  EXPECT_EQ(origin.x(), 691'414);
  EXPECT_EQ(origin.y(), 5'335'122);
  EXPECT_EQ(origin.z(), 522);
  const v1::Scan second = Send(kSecond, kCorner + kSecond);
  ASSERT_EQ(second.state(), v1::SCAN_STATE_MERGED) << second.state_message();
  EXPECT_NEAR(second.pose().translation().y(), kCorner.y() + kSecond.y(), 1e-3);

  // It is the job's for good.
  session_.reset();
  host_.reset();
  Start();
  session_ = fixture::LoadSession(host_->registry, "job");
  EXPECT_EQ(session_->Describe().origin().y(), 5'335'122);
  const auto stations = session_->model().Current().view->stations();
  ASSERT_EQ(stations.size(), 2u);
  EXPECT_NEAR(stations[0].position.x(), kCorner.x() + kFirst.x() - 691'414, 1e-3);
  const v1::Scan third = Send({1.2, 2.2, 1.4}, kCorner + Eigen::Vector3d(1.2, 2.2, 1.4));
  EXPECT_EQ(third.state(), v1::SCAN_STATE_MERGED) << third.state_message();
}

TEST_F(SessionOriginTest, StaysWhereItIsNearTheFirstScan) {
  ASSERT_EQ(Send(kFirst, kFirst).state(), v1::SCAN_STATE_MERGED);
  EXPECT_FALSE(session_->Describe().has_origin());
  // Another one does not move it.
  EXPECT_EQ(Send(kSecond, kCorner + kSecond).state(), v1::SCAN_STATE_FAILED);
  EXPECT_FALSE(session_->Describe().has_origin());
}

TEST(OriginByFirstScan, GoesByWhatTheScanAndTheSessionSay) {
  v1::Session session;
  session.mutable_model_config()->mutable_max_half_extent()->set_x(200);
  session.mutable_model_config()->mutable_max_half_extent()->set_y(200);
  session.mutable_model_config()->mutable_max_half_extent()->set_z(50);
  EXPECT_FALSE(OriginByFirstScan(session, {}).has_value());
  EXPECT_FALSE(OriginByFirstScan(session, At({99, -99, 24})).has_value());
  ASSERT_TRUE(OriginByFirstScan(session, At({0, 0, 520.4})).has_value()) << "altitude counts";
  EXPECT_EQ(OriginByFirstScan(session, At({0, 0, 520.4}))->z(), 520);
  v1::Upload targets;
  targets.add_targets()->set_name("unknown");
  v1::TargetSighting& known = *targets.add_targets();
  known.mutable_in_world()->set_x(5e5);
  ASSERT_TRUE(OriginByFirstScan(session, targets).has_value());
  EXPECT_EQ(OriginByFirstScan(session, targets)->x(), 5e5);
  session.mutable_origin();  // (0, 0, 0), stated
  EXPECT_FALSE(OriginByFirstScan(session, At({5e5, 0, 0})).has_value());
}

}  // namespace
}  // namespace vantage::session
