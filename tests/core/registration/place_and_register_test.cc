// What the alignment of a scan starts from: poses that nothing else would lead to.
#include "core/registration/place_and_register.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

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
       {PoseAt({-2.4, 1.9, 1.5}, 0.4), PoseAt({40, 7, 1.5}, 2.5), PoseAt({1.5, -1.2, 3.5}, -1.2)}) {
    scan_.prior->T_world_scan = wrong;
    scan_.prior->trusted = false;
    const auto result = Run();
    EXPECT_LT(Off(result), 0.005);
    EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful) << "a person decides";
    EXPECT_NE(result->verdict.reason.find("the pose given does not fit"), std::string::npos)
        << result->verdict.reason;
    scan_.prior->trusted = true;
    scan_.prior->covariance = 1e-4 * sensor::Matrix6d::Identity();
    EXPECT_FALSE(Run()->verdict.registered()) << "one that is trusted stands";
    EXPECT_GT(Off(Run()), 1);
    scan_.prior->covariance.reset();
  }
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
