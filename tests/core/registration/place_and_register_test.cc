// What the alignment of a scan starts from: poses that nothing else would lead to.
#include "core/registration/place_and_register.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

class PlaceAndRegisterTest : public testing::Test {
 protected:
  double Off(const absl::StatusOr<RegistrationResult>& result) const {
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? (result->T_world_scan.translation() - truth_.translation()).norm() : 1e9;
  }
  absl::StatusOr<RegistrationResult> Run() {
    return PlaceAndRegister(*model_, scan_, last_pose_, targets_, {}, serial_);
  }
  void SeeTargets() {
    for (const Eigen::Vector3d& place :
         {Eigen::Vector3d(2.9, 1, 2), Eigen::Vector3d(-2.9, 0, 1), Eigen::Vector3d(0, 2.4, 1.5)}) {
      TargetTie tie;
      tie.name = "T" + std::to_string(targets_.size());
      tie.in_world = place;
      tie.in_scan = truth_.inverse() * place;
      targets_.push_back(tie);
    }
  }

  parallel::Serial serial_;
  const BoxScene scene_ = FurnishedRoom(5);
  const Eigen::Isometry3d truth_ = PoseAt({0.9, 0.1, 1.5}, 2.5);
  const std::shared_ptr<const model::PlanningView> model_ =
      ModelFromScan(scene_, PoseAt({-1, -0.6, 1.4}, 0), {}, 35);
  sensor::Scan scan_ = ScanScene(scene_, truth_, {}, 36);
  Eigen::Isometry3d last_pose_ = PoseAt({-1, -0.6, 1.4}, 0);
  std::vector<TargetTie> targets_;
};

TEST_F(PlaceAndRegisterTest, StartsFromThePrior) {
  scan_.prior.emplace();
  scan_.prior->T_world_scan = PoseAt({0.95, 0.05, 1.5}, 2.48);
  const auto result = Run();
  EXPECT_LT(Off(result), 0.005);
  const auto same = RegisterWithTargets(*model_, scan_, *scan_.prior, {}, {}, serial_);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(result->T_world_scan.matrix(), same->T_world_scan.matrix());
}

// The pose in a file's header may be that of another project.
TEST_F(PlaceAndRegisterTest, WhereThePriorDoesNotFitTheSiteIsSearchedAndItIsSaid) {
  scan_.prior.emplace();
  for (const Eigen::Isometry3d& wrong :
       {PoseAt({-2.4, 1.9, 1.5}, 0.4), PoseAt({40, 7, 1.5}, 2.5), PoseAt({1.5, -1.2, 3.5}, -1.2),
        // In its place, with 2.5 degrees taken for radians; and in a national grid.
        PoseAt({0.9, 0.1, 1.5}, sensor::Radians(2.5)), PoseAt({4'512'345, 5'234'567, 120}, 1)}) {
    scan_.prior->T_world_scan = wrong;
    scan_.prior->from_file_header = false;
    scan_.prior->trusted = false;
    const auto result = Run();
    EXPECT_LT(Off(result), 0.005);
    EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful) << "a person decides";
    EXPECT_NE(result->verdict.reason.find("the pose given does not fit"), std::string::npos)
        << result->verdict.reason;
    scan_.prior->from_file_header = true;
    const auto of_header = Run();
    ASSERT_TRUE(of_header.ok());
    EXPECT_EQ(of_header->T_world_scan.matrix(), result->T_world_scan.matrix()) << "only words";
    const std::string said =
        absl::StrFormat("the pose in the file's header does not fit: it is %.2f m, and ",
                        (wrong.translation() - of_header->T_world_scan.translation()).norm());
    EXPECT_EQ(of_header->verdict.reason.rfind(said, 0), 0U) << of_header->verdict.reason;
    scan_.prior->trusted = true;
    scan_.prior->covariance = 1e-4 * sensor::Matrix6d::Identity();
    EXPECT_FALSE(Run()->verdict.registered()) << "one that is trusted stands";
    EXPECT_EQ(Run()->T_world_scan.matrix(), wrong.matrix());
    scan_.prior->covariance.reset();
  }
}

// People fill an eighth of the view. The place is right, and stays as the prior led to it.
TEST_F(PlaceAndRegisterTest, ARightPriorStaysAlsoWhereMuchHasChanged) {
  BoxScene with_people = scene_;
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(0.1, 0.6), Eigen::Vector2d(1.5, -0.5)}) {
    with_people.solids.emplace_back(Eigen::Vector3d(at.x() - 0.3, at.y() - 0.2, 0),
                                    Eigen::Vector3d(at.x() + 0.3, at.y() + 0.2, 1.9));
  }
  scan_ = ScanScene(with_people, truth_, {}, 36);
  scan_.prior.emplace();
  scan_.prior->T_world_scan = PoseAt({0.95, 0.05, 1.5}, 2.48);
  scan_.prior->from_file_header = true;
  const auto result = Run();
  const auto as_given = RegisterWithTargets(*model_, scan_, *scan_.prior, {}, {}, serial_);
  ASSERT_TRUE(result.ok() && as_given.ok());
  EXPECT_GT(as_given->contradiction_share, 0.1) << "else nothing is searched";
  EXPECT_LT(Off(result), 0.01);
  EXPECT_EQ(result->T_world_scan.matrix(), as_given->T_world_scan.matrix());
  EXPECT_EQ(result->verdict.reason, as_given->verdict.reason);
}

// The same room twice, 20 m apart, and a header from elsewhere: nobody can tell which.
TEST_F(PlaceAndRegisterTest, PlacesThatLookTheSameAreAllNamed) {
  const Eigen::Vector3d away(20, 0, 0);
  const Eigen::Isometry3d first = PoseAt({-1, -0.6, 1.4}, 0);
  const auto partial = model::PartialModel::Create({}).value();
  partial->Insert("one", ScanScene(scene_, first, {}, 1), first, serial_).value();
  Eigen::Isometry3d second = first;
  second.pretranslate(away);
  partial->Insert("two", ScanScene(scene_, first, {}, 2), second, serial_).value();
  scan_.prior.emplace();
  scan_.prior->T_world_scan = PoseAt({10, 15, 1.5}, 0.3);
  scan_.prior->from_file_header = true;
  const auto result = PlaceAndRegister(*partial->Publish(), scan_, second, {}, {}, serial_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful);
  ASSERT_EQ(result->rival_poses.size(), 1U) << result->verdict.reason;
  const Eigen::Vector3d found = result->T_world_scan.translation();
  const Eigen::Vector3d other = result->rival_poses[0].T_world_scan.translation();
  EXPECT_NEAR(
      std::min((found - truth_.translation()).norm(), (other - truth_.translation()).norm()), 0,
      0.01);
  EXPECT_NEAR((found - other).norm(), away.norm(), 0.02);
  EXPECT_NE(result->verdict.reason.find("several known places look the same"), std::string::npos)
      << result->verdict.reason;
}

// A header that says the storey below, where the room is another one.
TEST_F(PlaceAndRegisterTest, TheRightStoreyIsFound) {
  const Eigen::Vector3d up(0, 0, 3.1);
  const Eigen::Isometry3d first = PoseAt({-1, -0.6, 1.4}, 0);
  const auto partial = model::PartialModel::Create({}).value();
  BoxScene below = FurnishedRoom(9);
  below.room = Eigen::AlignedBox3d(Eigen::Vector3d(-1.7, -3.4, 0), Eigen::Vector3d(4.1, 1.6, 2.7));
  partial->Insert("low", ScanScene(below, first, {}, 1), first, serial_).value();
  Eigen::Isometry3d above = first;
  above.pretranslate(up);
  partial->Insert("high", ScanScene(scene_, first, {}, 2), above, serial_).value();
  scan_.prior.emplace();
  scan_.prior->T_world_scan = truth_;
  scan_.prior->from_file_header = true;
  const auto result = PlaceAndRegister(*partial->Publish(), scan_, above, {}, {}, serial_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful);
  EXPECT_LT((result->T_world_scan.translation() - truth_.translation() - up).norm(), 0.01);
  EXPECT_EQ(
      result->verdict.reason.rfind("the pose in the file's header does not fit: it is 3.1", 0), 0U)
      << result->verdict.reason;
}

TEST_F(PlaceAndRegisterTest, WithoutOneFromWhatTheTargetsSay) {
  SeeTargets();
  const auto result = Run();
  EXPECT_LT(Off(result), 0.005);
  sensor::PosePrior at_truth;
  at_truth.T_world_scan = PoseFromTargets(targets_)->T_world_scan;
  const auto same = RegisterWithTargets(*model_, scan_, at_truth, targets_, {}, serial_);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(result->T_world_scan.matrix(), same->T_world_scan.matrix());
}

TEST_F(PlaceAndRegisterTest, WithNeitherItSearchesTheSite) { EXPECT_LT(Off(Run()), 0.005); }

// Two targets give no pose, but hold the one that was found.
TEST_F(PlaceAndRegisterTest, TooFewTargetsHoldWhatWasFound) {
  SeeTargets();
  targets_.pop_back();
  const auto result = Run();
  EXPECT_LT(Off(result), 0.005);
  targets_[0].in_world += Eigen::Vector3d(0.2, 0, 0);
  const auto contradicted = Run();
  ASSERT_TRUE(contradicted.ok());
  EXPECT_FALSE(contradicted->verdict.registered());
}

}  // namespace
}  // namespace vantage::registration
