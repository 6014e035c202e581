// Scans in doubt are tried again when the model has changed, and what is proposed goes with what it
// rests on.
#include "server/session/doubt_proposals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/sensor/encoding.h"
#include "google/protobuf/util/message_differencer.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/store/memory_store.h"
#include "tests/core/registration/box_scene.h"
#include "tests/server/fixture/room_scan.h"
#include "tests/server/fixture/script.h"
#include "tests/server/fixture/session_host.h"

namespace vantage::session {
namespace {

using google::protobuf::util::MessageDifferencer;
using testing::Contains;
using testing::HasSubstr;

// A hall that looks the same after half a turn, but for a block behind one of its two pillars.
registration::BoxScene HallWithASecret() {
  registration::BoxScene scene;
  scene.room = {Eigen::Vector3d(-5, -2.5, 0), Eigen::Vector3d(5, 2.5, 2.6)};
  scene.solids = {{Eigen::Vector3d(2.2, -0.8, 0), Eigen::Vector3d(2.8, 0.8, 2.6)},
                  {Eigen::Vector3d(-2.8, -0.8, 0), Eigen::Vector3d(-2.2, 0.8, 2.6)},
                  {Eigen::Vector3d(3.0, -0.9, 0), Eigen::Vector3d(5, 0.9, 2.6)}};
  return scene;
}

v1::PosePrior PriorAtPose(const Eigen::Isometry3d& pose) {
  v1::PosePrior prior;
  *prior.mutable_pose() = conversion::WritePose(pose, Eigen::Vector3d::Zero());
  return prior;
}

// In the hall the first scan stands in the middle and sees neither place behind a pillar. The
// second, of which nothing is known, stands beside the block: it may have been made at either end.
// The third shows the block, and the fourth that there is none at the other end: either alone would
// leave both, since a block may be behind a pillar that nobody has looked behind, and one that came
// may have been carried there.
class DoubtProposalsTest : public testing::Test {
 protected:
  static constexpr unsigned kFirstSeed = 3;

  DoubtProposalsTest()
      : host_(std::make_unique<fixture::SessionHost>(store_, Algorithms::Core())),
        session_(fixture::OpenSession(host_->registry, "job")) {}
  void Restart() {
    session_.reset();
    host_.reset();
    host_ = std::make_unique<fixture::SessionHost>(store_, Algorithms::Core());
    session_ = fixture::LoadSession(host_->registry, "job");
  }
  std::string Send(const Eigen::Isometry3d& truth, bool with_prior, unsigned seed) {
    const v1::PosePrior prior = PriorAtPose(truth);
    const auto upload = fixture::SendScan(
        *session_, sensor::EncodeRangeImage(registration::ScanScene(hall_, truth, {}, seed).image),
        with_prior ? &prior : nullptr);
    EXPECT_TRUE(upload.ok()) << upload.status();
    session_->WaitUntilIdle();
    return upload->scan();
  }
  void SendUntilInDoubt() {
    Send(registration::PoseAt({0, 0, 1.4}, 0), true, kFirstSeed);
    doubtful_ = Send(beside_block_, false, 4);
    ASSERT_EQ(Doubtful().state(), v1::SCAN_STATE_DOUBTFUL) << Doubtful().state_message();
    ASSERT_EQ(Doubtful().registration().verdict().basis(), v1::REGISTRATION_BASIS_RIVAL_POSE)
        << Doubtful().state_message();
    ASSERT_EQ(Doubtful().registration().rival_poses_size(), 1);
    ASSERT_FALSE(Doubtful().has_pose_proposal());
  }
  std::string SendBesideTheBlock() {
    return Send(registration::PoseAt({3.6, 1.5, 1.4}, 0.3), true, 5);
  }
  std::string SendFromTheOtherEnd() {
    return Send(registration::PoseAt({-4, -1.8, 1.4}, 0.3), true, 6);
  }
  v1::Scan Doubtful() { return session_->scans().Get(doubtful_).value(); }
  double OffOf(const v1::Pose& pose) const {
    return (conversion::ReadOwnVector(pose.translation()) - beside_block_.translation()).norm();
  }
  std::vector<v1::Scan> RefusalsTold() {
    std::vector<v1::Scan> told;
    const std::vector<v1::SessionEvent> events = session_->journal().Events(0, 1000).value();
    for (const v1::SessionEvent& event : events) {
      if (event.scan_refused().scan().name() == doubtful_) {
        told.push_back(event.scan_refused().scan());
      }
    }
    return told;
  }

  const registration::BoxScene hall_ = HallWithASecret();
  const Eigen::Isometry3d beside_block_ = registration::PoseAt({4, 1.9, 1.4}, 1.0);
  store::MemoryStore store_{size_t{256} << 20};
  std::unique_ptr<fixture::SessionHost> host_;
  std::shared_ptr<Session> session_;
  std::string doubtful_;
};

TEST_F(DoubtProposalsTest, ALaterScanSaysWhichOfItsPosesIsRight) {
  SendUntilInDoubt();
  const v1::Scan before = Doubtful();
  SendBesideTheBlock();
  EXPECT_TRUE(MessageDifferencer::Equals(Doubtful(), before)) << "both are left, and no news";
  const std::string fourth = SendFromTheOtherEnd();
  const v1::Scan scan = Doubtful();
  ASSERT_TRUE(scan.has_pose_proposal()) << scan.state_message();
  EXPECT_EQ(scan.state(), v1::SCAN_STATE_DOUBTFUL) << "a person decides";
  const v1::PoseProposal& proposal = scan.pose_proposal();
  EXPECT_LT(OffOf(proposal.registration().pose()), 0.005);
  ASSERT_TRUE(proposal.has_rival_pose());
  const v1::Pose& named = proposal.rival_pose() == 0 ? before.registration().pose()
                                                     : before.registration().rival_poses(0).pose();
  EXPECT_LT(OffOf(named), 0.05) << "by the number of the poses as they were";
  EXPECT_THAT(proposal.contradicting_scans(), Contains(fourth));
  EXPECT_THAT(proposal.message(), HasSubstr("of its 2 poses is right"));
  EXPECT_THAT(proposal.message(), HasSubstr("scan-4"));
  EXPECT_THAT(scan.state_message(), HasSubstr(proposal.message()));
  EXPECT_TRUE(MessageDifferencer::Equals(scan.registration(), before.registration()));
  EXPECT_NE(scan.etag(), before.etag());
  // WatchSession tells it.
  ASSERT_EQ(RefusalsTold().size(), 2u);
  EXPECT_TRUE(RefusalsTold()[1].has_pose_proposal());

  ASSERT_TRUE(session_->scans().Accept(doubtful_, {0, true, scan.etag()}, {}).ok());
  session_->WaitUntilIdle();
  const v1::Scan merged = Doubtful();
  EXPECT_EQ(merged.state(), v1::SCAN_STATE_MERGED) << merged.state_message();
  EXPECT_EQ(merged.pose_source(), v1::POSE_SOURCE_ACCEPTED);
  EXPECT_LT(OffOf(merged.pose()), 0.005);
  EXPECT_FALSE(merged.has_pose_proposal());
  EXPECT_EQ(merged.etag(), "");
}

TEST_F(DoubtProposalsTest, WithdrawingWhatDecidedTakesItBack) {
  SendUntilInDoubt();
  SendBesideTheBlock();
  const v1::Scan before = Doubtful();
  const std::string fourth = SendFromTheOtherEnd();
  ASSERT_TRUE(Doubtful().has_pose_proposal());
  ASSERT_TRUE(session_->scans().Withdraw(fourth, {}).ok());
  session_->WaitUntilIdle();
  v1::Scan after = Doubtful();
  EXPECT_FALSE(after.has_pose_proposal());
  EXPECT_EQ(after.state_message(), before.state_message());
  EXPECT_EQ(after.etag(), before.etag()) << "the same choice as before";
  *after.mutable_update_time() = before.update_time();
  EXPECT_TRUE(MessageDifferencer::Equals(after, before)) << "no trace is left";
  EXPECT_EQ(RefusalsTold().size(), 3u);
}

TEST_F(DoubtProposalsTest, ARestartKeepsItAndTellsNothingTwice) {
  SendUntilInDoubt();
  SendBesideTheBlock();
  SendFromTheOtherEnd();
  const v1::Scan before = Doubtful();
  ASSERT_TRUE(before.has_pose_proposal());
  Restart();
  EXPECT_TRUE(MessageDifferencer::Equals(Doubtful(), before));
  session_->WaitUntilIdle();
  EXPECT_EQ(RefusalsTold().size(), 2u);
}

// The others first: then it registers by itself, and where it is proposed else.
TEST_F(DoubtProposalsTest, WhatIsProposedIsWhatWouldHaveRegistered) {
  SendUntilInDoubt();
  SendBesideTheBlock();
  SendFromTheOtherEnd();
  const v1::Pose proposed = Doubtful().pose_proposal().registration().pose();
  store::MemoryStore store(size_t{256} << 20);
  fixture::SessionHost host(store, Algorithms::Core());
  const auto other = fixture::OpenSession(host.registry, "job");
  session_ = other;
  Send(registration::PoseAt({0, 0, 1.4}, 0), true, kFirstSeed);
  SendBesideTheBlock();
  SendFromTheOtherEnd();
  const v1::Scan registered = other->scans().Get(Send(beside_block_, false, 4)).value();
  ASSERT_EQ(registered.state(), v1::SCAN_STATE_MERGED) << registered.state_message();
  EXPECT_TRUE(MessageDifferencer::Equals(registered.pose(), proposed));
  session_.reset();
}

// Scripted from here on: what a person accepts is what was looked at.
class ChosenPoseTest : public testing::Test {
 protected:
  ChosenPoseTest() : host_(store_, script_.Make()) {
    session_ = fixture::OpenSession(host_.registry, "job");
    Send({2, 1.5, 1.4});
    script_.SetVerdict(registration::RegistrationOutcome::kDoubtful);
    doubtful_ = Send({2.3, 1.5, 1.4});
  }
  std::string Send(const Eigen::Vector3d& at) {
    const v1::PosePrior prior = fixture::PriorAt(at.x(), at.y(), at.z());
    const auto upload = fixture::SendScan(*session_, fixture::EncodedRoom(at), &prior);
    EXPECT_TRUE(upload.ok()) << upload.status();
    session_->WaitUntilIdle();
    return upload->scan();
  }
  v1::Scan Doubtful() { return session_->scans().Get(doubtful_).value(); }

  store::MemoryStore store_{size_t{256} << 20};
  fixture::Script script_;
  fixture::SessionHost host_;
  std::shared_ptr<Session> session_;
  std::string doubtful_;
};

TEST_F(ChosenPoseTest, IsRefusedWherePosesAreOthersSinceTheyWereSeen) {
  const std::string seen = Doubtful().etag();
  ASSERT_FALSE(seen.empty());
  // Somebody has it aligned anew from elsewhere, which leaves it in doubt.
  ASSERT_TRUE(
      session_->scans().SetPose(doubtful_, fixture::PriorAt(2.6, 1.5, 1.4), false, {}).ok());
  session_->WaitUntilIdle();
  ASSERT_EQ(Doubtful().state(), v1::SCAN_STATE_DOUBTFUL);
  const absl::Status refused = session_->scans().Accept(doubtful_, {1, false, seen}, {}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kAborted);
  EXPECT_EQ(contract::ReasonOf(refused), "ETAG_STALE");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("etag"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("read it again"));
  EXPECT_EQ(Doubtful().state(), v1::SCAN_STATE_DOUBTFUL);
  EXPECT_TRUE(session_->scans().Accept(doubtful_, {1, false, Doubtful().etag()}, {}).ok());
}

TEST_F(ChosenPoseTest, MustBeProposedToBeAcceptedAsProposed) {
  const absl::Status refused = session_->scans().Accept(doubtful_, {0, true, ""}, {}).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("proposed"));
}

// Without links nothing but targets settles a doubt, and the script has no model to tell it by.
TEST_F(ChosenPoseTest, IsKeptWhileNothingElseIsKnown) {
  const std::string seen = Doubtful().etag();
  script_.SetVerdict(registration::RegistrationOutcome::kRegistered);
  Send({2.8, 1.5, 1.4});
  EXPECT_EQ(Doubtful().etag(), seen);
  EXPECT_FALSE(Doubtful().has_pose_proposal());
}

}  // namespace
}  // namespace vantage::session
