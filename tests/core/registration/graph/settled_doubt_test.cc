// Scans in doubt, and what other scans say of their poses.
#include "core/registration/graph/settled_doubt.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace vantage::registration {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Eigen::Isometry3d PoseAlong(double x) { return Eigen::Isometry3d(Eigen::Translation3d(x, 0, 1.5)); }

PairAtPose Tied(const std::string& scan, bool since = false, double contradicts = 0) {
  PairAtPose pair{"sessions/job/scans/" + scan, since, {}};
  pair.outcome.link.emplace();
  pair.outcome.contradiction_share = contradicts;
  return pair;
}
PairAtPose Apart(const std::string& scan, bool since, double contradicts) {
  PairAtPose pair{"sessions/job/scans/" + scan, since, {}};
  pair.outcome.contradiction_share = contradicts;
  return pair;
}

RegistrationResult RegisteredAt(double x) {
  RegistrationResult result;
  result.T_world_scan = PoseAlong(x);
  result.verdict.outcome = RegistrationOutcome::kRegistered;
  result.verdict.bases = {RegistrationBasis::kScanGeometry};
  result.verdict.error_bound = 0.004;
  return result;
}

// Made at 2.5 m, and aligned at first a bay nearer; scan-7 came since and shows where the bays end.
class SettledDoubtTest : public testing::Test {
 protected:
  std::optional<SettledDoubt> Settle() const { return SettleDoubt(anew_, at_last_, poses_); }

  RegistrationResult anew_ = RegisteredAt(2.51);
  std::vector<PairAtPose> at_last_ = {Tied("scan-1"), Tied("scan-7", true)};
  std::vector<DoubtfulPose> poses_ = {{PoseAlong(0), {Tied("scan-1"), Apart("scan-7", true, 0.5)}},
                                      {PoseAlong(2.5), {Tied("scan-1"), Tied("scan-7", true)}}};
};

TEST_F(SettledDoubtTest, ThePoseThatIsLeftIsNamedWithWhatDecides) {
  const std::optional<SettledDoubt> settled = Settle();
  ASSERT_TRUE(settled.has_value());
  EXPECT_EQ(settled->pose, 1u);
  EXPECT_THAT(settled->agreeing,
              ElementsAre("sessions/job/scans/scan-1", "sessions/job/scans/scan-7"));
  EXPECT_THAT(settled->contradicting, ElementsAre("sessions/job/scans/scan-7"));
  EXPECT_EQ(settled->words,
            "by scan-7, which contradicts the other, the second of its 2 poses is right: it "
            "registers there to 4.0 mm, and nowhere else");
}

// All that the pairs say could be the other way round: what repeats itself agrees with itself.
TEST_F(SettledDoubtTest, LinksAloneSettleNothing) {
  anew_.verdict.outcome = RegistrationOutcome::kDoubtful;
  anew_.verdict.bases = {RegistrationBasis::kRivalPose};
  EXPECT_FALSE(Settle().has_value());
}

TEST_F(SettledDoubtTest, AThirdPlaceIsADoubtMore) {
  anew_ = RegisteredAt(5.0);
  EXPECT_FALSE(Settle().has_value());
  anew_ = RegisteredAt(2.5);
  anew_.T_world_scan.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  EXPECT_FALSE(Settle().has_value()) << "turned by half a turn";
}

TEST_F(SettledDoubtTest, LinksThatSpeakAgainstItKeepItInDoubt) {
  at_last_ = {Tied("scan-1"), Apart("scan-7", true, 0.3)};
  poses_[0].pairs = {Tied("scan-1"), Tied("scan-7", true)};
  EXPECT_FALSE(Settle().has_value()) << "the other pose is tied to more";
  poses_[0].pairs = {Tied("scan-1"), Apart("scan-7", true, 0.3)};
  EXPECT_TRUE(Settle().has_value()) << "one ties it, one contradicts it: something was moved";
  at_last_ = {Apart("scan-1", false, 0.3), Tied("scan-7", true), Apart("scan-8", true, 0.3)};
  EXPECT_FALSE(Settle().has_value()) << "more contradict it than tie it";
  at_last_ = {Apart("scan-1", false, 0), Apart("scan-7", true, 0)};
  poses_[0].pairs = at_last_;
  poses_[1].pairs = at_last_;
  EXPECT_FALSE(Settle().has_value()) << "nothing ties it to any scan";
}

// Twins that only targets tell apart: all surfaces are the same at both.
TEST_F(SettledDoubtTest, TargetsTellTwinsApart) {
  at_last_ = {Tied("scan-1"), Apart("scan-7", true, 0)};
  poses_[0].pairs = {Tied("scan-1"), Tied("scan-7", true)};
  poses_[1].pairs = at_last_;
  anew_.verdict.bases = {RegistrationBasis::kLevelling, RegistrationBasis::kTargets};
  const std::optional<SettledDoubt> settled = Settle();
  ASSERT_TRUE(settled.has_value());
  EXPECT_THAT(settled->words, HasSubstr("by its targets the second of its 2 poses"));
}

// Too little overlap, or too weak a shape: there was one pose, and it may have been far off.
TEST_F(SettledDoubtTest, OneThatHadNoRivalsMayTurnOutAnywhere) {
  poses_.resize(1);
  std::optional<SettledDoubt> settled = Settle();
  ASSERT_TRUE(settled.has_value());
  EXPECT_FALSE(settled->pose.has_value());
  EXPECT_EQ(settled->words,
            "by the link to scan-7 it was not made there, but 2.51 m off: it registers so to 4.0 "
            "mm, and nowhere else");
  EXPECT_THAT(settled->contradicting, IsEmpty());
  poses_[0].T_world_scan = PoseAlong(2.45);
  settled = Settle();
  ASSERT_TRUE(settled.has_value());
  EXPECT_EQ(settled->pose, 0u);
  EXPECT_THAT(settled->words, HasSubstr("by the link to scan-7 the pose that was found is right"));
  at_last_[1].came_since = false;
  EXPECT_THAT(Settle()->words, HasSubstr("by the model as it is now"));
}

TEST_F(SettledDoubtTest, TheNearestOfPosesThatLieCloseTogetherIsMeant) {
  poses_[0].T_world_scan = PoseAlong(2.3);
  EXPECT_EQ(Settle()->pose, 1u);
  anew_ = RegisteredAt(2.35);
  EXPECT_EQ(Settle()->pose, 0u);
}

}  // namespace
}  // namespace vantage::registration
