// Where the first scan goes: whom it believes, and what is left of the levelling.
#include "core/registration/first_pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vantage::registration {
namespace {

using testing::HasSubstr;

Eigen::Isometry3d At(const Eigen::Vector3d& place, double heading) {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  T_world_scan.linear() = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T_world_scan.translation() = place;
  return T_world_scan;
}

// Four targets as a scanner at `T_world_scan` sees them.
std::vector<TargetTie> TargetsFrom(const Eigen::Isometry3d& T_world_scan) {
  std::vector<TargetTie> ties;
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5, 0, 1),
                                       Eigen::Vector3d(0, 4, 2), Eigen::Vector3d(5, 4, 0.5)}) {
    TargetTie& tie = ties.emplace_back();
    tie.name = std::string(1, static_cast<char>('a' + ties.size() - 1));
    tie.in_world = place;
    tie.in_scan = T_world_scan.inverse() * place;
  }
  return ties;
}

TEST(FirstPriorTest, ATrustedPriorCountsMoreThanTargetsAndTheseMoreThanAGuess) {
  const std::vector<TargetTie> targets = TargetsFrom(At({2, 1, 1.5}, 0.7));
  sensor::PosePrior stated;
  stated.T_world_scan = At({9, 9, 9}, 0);

  const auto guess = FirstPrior(stated, targets);
  ASSERT_TRUE(guess.ok() && guess->has_value());
  EXPECT_TRUE((*guess)->trusted);
  EXPECT_TRUE((*guess)->T_world_scan.isApprox(At({2, 1, 1.5}, 0.7), 1e-9));
  EXPECT_TRUE((*guess)->covariance.has_value());

  stated.trusted = true;
  const auto trusted = FirstPrior(stated, targets);
  ASSERT_TRUE(trusted.ok() && trusted->has_value());
  EXPECT_TRUE((*trusted)->T_world_scan.isApprox(At({9, 9, 9}, 0), 1e-12));

  const auto none = FirstPrior(std::nullopt, targets);
  ASSERT_TRUE(none.ok() && none->has_value());
  EXPECT_TRUE((*none)->trusted);
}

TEST(FirstPriorTest, WithoutEnoughTargetsThePriorIsWhatWasStated) {
  const std::vector<TargetTie> all = TargetsFrom(At({2, 1, 1.5}, 0.7));
  const std::span<const TargetTie> two(all.data(), 2);
  EXPECT_FALSE(FirstPrior(std::nullopt, two)->has_value());
  sensor::PosePrior stated;
  stated.T_world_scan = At({9, 9, 9}, 0);
  const auto prior = FirstPrior(stated, two);
  ASSERT_TRUE(prior.ok() && prior->has_value());
  EXPECT_FALSE((*prior)->trusted);
  EXPECT_TRUE((*prior)->T_world_scan.isApprox(stated.T_world_scan, 1e-12));
}

TEST(FirstPriorTest, TargetsThatContradictEachOtherAreAnErrorThatNamesOne) {
  std::vector<TargetTie> targets = TargetsFrom(At({2, 1, 1.5}, 0.7));
  targets[2].in_world.z() += 0.5;
  sensor::PosePrior trusted;
  trusted.trusted = true;
  for (const std::optional<sensor::PosePrior>& stated :
       std::vector<std::optional<sensor::PosePrior>>{trusted, std::nullopt}) {
    const absl::Status refused = FirstPrior(stated, targets).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.message()), HasSubstr("target 'c' lies"));
  }
}

TEST(FirstPoseTest, AnUntrustedPriorGivesPlaceAndHeadingAndLeavesTheTilt) {
  Levelling levelling;
  levelling.T_world_scan.linear() = (Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()) *
                                     Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()))
                                        .toRotationMatrix();
  EXPECT_TRUE(FirstPose(levelling, std::nullopt).isApprox(levelling.T_world_scan, 1e-12));

  sensor::PosePrior prior;
  prior.T_world_scan = At({4, 5, 1.6}, 2.5);
  const Eigen::Isometry3d pose = FirstPose(levelling, prior);
  EXPECT_TRUE(pose.translation().isApprox(Eigen::Vector3d(4, 5, 1.6), 1e-12));
  const Eigen::Vector3d ahead = pose.linear() * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 2.5, 1e-12);
  // Up in the scanner's frame, before and after: a turn about the vertical does not change it.
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  EXPECT_TRUE((pose.linear().transpose() * up)
                  .isApprox(levelling.T_world_scan.linear().transpose() * up, 1e-12));
  EXPECT_NEAR(pose.linear().determinant(), 1, 1e-12);

  prior.trusted = true;
  EXPECT_TRUE(FirstPose(levelling, prior).isApprox(prior.T_world_scan, 1e-12));
}

}  // namespace
}  // namespace vantage::registration
