// Levelling, targets and trusted poses: each is checked against the model, and the verdict names
// the basis that decided.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"
#include "tests/core/registration/shape.h"

namespace vantage::registration {
namespace {

constexpr double kNormalNoise = sensor::Radians(2);
constexpr double kTargetSigma = 0.001;  // m

// A target at a place in the world, as a scanner at `truth` measures it.
TargetTie Seen(const std::string& name, const Eigen::Vector3d& in_world,
               const Eigen::Isometry3d& truth, std::mt19937_64& random) {
  std::normal_distribution<double> noise(0, kTargetSigma);
  const Eigen::Vector3d error(noise(random), noise(random), noise(random));
  return {name, truth.inverse() * in_world + error, in_world, kTargetSigma};
}

class BareCorridor : public testing::Test {
 protected:
  void SetUp() override {
    model_ = ModelOf(Corridor(), PoseAt({0, 0, 1.4}, 0), {}, kNormalNoise, 3);
    truth_ = PoseAt({1.5, 0.2, 1.4}, 0.4);
    scan_ = ScanScene(Corridor(), truth_, {}, 4);
    prior_.T_world_scan = truth_;
    prior_.T_world_scan.translation().x() += 0.2;
  }
  RegistrationResult Run() {
    auto result = RegisterWithTargets(*model_, scan_, prior_, targets_, {}, serial_);
    EXPECT_TRUE(result.ok()) << result.status();
    return result.value_or(RegistrationResult());
  }
  double Off(const RegistrationResult& result) const {
    return (result.T_world_scan.translation() - truth_.translation()).norm();
  }

  parallel::Serial serial_;
  std::mt19937_64 random_{5};
  std::shared_ptr<const model::PlanningView> model_;
  Eigen::Isometry3d truth_;
  sensor::Scan scan_;
  sensor::PosePrior prior_;
  std::vector<TargetTie> targets_;
};

TEST_F(BareCorridor, FailsAlongItsAxisLevelledOrNot) {
  for (const bool levelled : {false, true}) {
    if (levelled) prior_.levelled_sigma = sensor::Radians(0.005);
    const RegistrationResult result = Run();
    EXPECT_EQ(result.verdict.outcome, RegistrationOutcome::kFailed);
    EXPECT_EQ(result.verdict.weakest_words, "sliding along x");
    EXPECT_NE(result.verdict.remedy.find("target"), std::string::npos) << result.verdict.remedy;
  }
}

TEST_F(BareCorridor, StaysAlongItsAxisAsThePriorHasIt) {
  for (const double off : {-0.3, -0.1, 0.25}) {
    prior_.T_world_scan = truth_;
    prior_.T_world_scan.translation() += Eigen::Vector3d(off, -0.1, 0.05);
    const Eigen::Vector3d end = Run().T_world_scan.translation();
    EXPECT_NEAR(end.x(), prior_.T_world_scan.translation().x(), 0.002) << off;
    EXPECT_NEAR(end.y(), truth_.translation().y(), 0.003) << off;
  }
}

TEST_F(BareCorridor, TwoTargetsCureIt) {
  targets_ = {Seen("T1", {4, -1, 1.2}, truth_, random_), Seen("T2", {-2, 1, 1.7}, truth_, random_)};
  const RegistrationResult result = Run();
  EXPECT_TRUE(result.verdict.registered()) << result.verdict.reason;
  EXPECT_EQ(BasesText(result.verdict.bases), "targets");
  EXPECT_LT(Off(result), 0.004);
  EXPECT_LT(result.verdict.judged_bound, 0.010);
}

TEST_F(BareCorridor, TargetsThatContradictEachOtherAreNamed) {
  targets_ = {Seen("T1", {4, -1, 1.2}, truth_, random_), Seen("T2", {-2, 1, 1.7}, truth_, random_)};
  targets_[1].in_world.x() += 0.10;  // moved since, or mistaken for another
  const RegistrationResult result = Run();
  EXPECT_FALSE(result.verdict.registered());
  EXPECT_EQ(BasesText(result.verdict.bases), "targets");
  EXPECT_NE(result.verdict.reason.find("target 'T"), std::string::npos) << result.verdict.reason;
}

TEST_F(BareCorridor, TargetsOffTheSurfacesAreNamed) {
  // Both agree with each other, but the walls say otherwise.
  for (TargetTie tie :
       {Seen("T1", {4, -1, 1.2}, truth_, random_), Seen("T2", {-2, 1, 1.7}, truth_, random_)}) {
    tie.in_world.z() += 0.05;
    targets_.push_back(tie);
  }
  const RegistrationResult result = Run();
  EXPECT_FALSE(result.verdict.registered()) << 1000 * Off(result) << " mm off";
}

TEST_F(BareCorridor, TrustedPoseDecidesAlongTheAxisAndIsCheckedAcross) {
  prior_.trusted = true;
  prior_.T_world_scan = truth_;
  prior_.covariance = sensor::Matrix6d::Identity() * 1e-6;
  RegistrationResult result = Run();
  EXPECT_TRUE(result.verdict.registered()) << result.verdict.reason;
  EXPECT_EQ(BasesText(result.verdict.bases), "trusted pose");
  prior_.T_world_scan.translation().y() += 0.04;  // into a wall
  result = Run();
  EXPECT_FALSE(result.verdict.registered());
  EXPECT_EQ(BasesText(result.verdict.bases), "trusted pose");
}

TEST_F(BareCorridor, BadTargetsAreRefusedByName) {
  targets_ = {{"T9", {1, 0, 0}, {2, 0, 0}, 0.0}};
  const auto result = RegisterWithTargets(*model_, scan_, prior_, targets_, {}, serial_);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(result.status().message().find("T9"), std::string::npos) << result.status();
}

// What targets say by themselves.
TEST(PoseFromTargets, IsAsGoodAsItSays) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(-6, 6);
  constexpr int kDraws = 400;
  double chi2 = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::Isometry3d truth =
        Disturbed(PoseAt({place(random), place(random), 1.5}, place(random)), 0.1, 0.05, random);
    const int count = 3 + draw % 4;
    std::vector<TargetTie> ties;
    ties.reserve(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i) {
      ties.push_back(Seen("T" + std::to_string(i), {place(random), place(random), place(random)},
                          truth, random));
    }
    const std::optional<TargetPose> pose = PoseFromTargets(ties);
    if (!pose.has_value()) continue;  // about in a line
    EXPECT_LT(pose->worst_share, 1);
    const Eigen::AngleAxisd turn(pose->T_world_scan.linear() * truth.linear().transpose());
    sensor::Vector6d off;
    off << turn.angle() * turn.axis(), pose->T_world_scan.translation() - truth.translation();
    chi2 += off.dot(pose->covariance.ldlt().solve(off)) / kDraws;
  }
  EXPECT_NEAR(chi2, 6, 0.6);
}

TEST(PoseFromTargets, NeedsThreeThatAreNotInALine) {
  std::mt19937_64 random(12);
  const Eigen::Isometry3d truth = PoseAt({1, 2, 1.5}, 0.5);
  std::vector<TargetTie> ties = {Seen("A", {4, -1, 1.2}, truth, random),
                                 Seen("B", {4, 1, 1.2}, truth, random)};
  EXPECT_FALSE(PoseFromTargets(ties).has_value());
  ties.push_back(Seen("C", {4, 3, 1.2}, truth, random));
  EXPECT_FALSE(PoseFromTargets(ties).has_value());
  ties.push_back(Seen("D", {1, 0, 2.5}, truth, random));
  ASSERT_TRUE(PoseFromTargets(ties).has_value());
  ties[1].in_world.y() += 0.2;
  EXPECT_GT(PoseFromTargets(ties)->worst_share, 1);
}

// A bare hall of which the scanner measures a low band of wall and a little floor around itself:
// all but the tilt is firm.
TEST(BareHall, LevelledScannerPassesInTilt) {
  BoxScene hall;
  hall.room = Eigen::AlignedBox3d(Eigen::Vector3d(-9, -8, 0), Eigen::Vector3d(9, 8, 12));
  ScanSettings band;
  band.blind = {{sensor::Radians(-52), sensor::Radians(-1.5)},
                {sensor::Radians(3), sensor::Radians(90)}};
  const Eigen::Isometry3d truth = PoseAt({1.0, 0.5, 1.5}, 0.3);
  const sensor::Scan scan = ScanScene(hall, truth, band, 21);
  const auto model = ModelOf(hall, PoseAt({0, 0, 1.5}, 0), band, kNormalNoise, 22);
  parallel::Serial serial;
  sensor::PosePrior prior;
  prior.T_world_scan =
      PoseAt({1.05, 0.45, 1.52}, 0.32, sensor::Radians(0.3), sensor::Radians(-0.2));
  const auto bare = Register(*model, scan, prior, {}, serial);
  prior.T_world_scan = PoseAt({1.05, 0.45, 1.52}, 0.32);
  prior.levelled_sigma = sensor::Radians(0.003);
  const auto levelled = Register(*model, scan, prior, {}, serial);
  ASSERT_TRUE(bare.ok() && levelled.ok());
  EXPECT_FALSE(bare->verdict.registered()) << 1000 * bare->verdict.judged_bound << " mm";
  EXPECT_EQ(bare->verdict.weakest_words.rfind("tilting", 0), 0U) << bare->verdict.weakest_words;
  EXPECT_TRUE(levelled->verdict.registered()) << levelled->verdict.reason;
  EXPECT_EQ(BasesText(levelled->verdict.bases), "levelling");
}

TEST(Targets, AreWorthWhatTheirLeverSays) {
  const OverlapGeometry g = CorridorShape(0, 1).Geometry();
  // Two targets 4 m apart across the centroid, along x: 1 mm each. The turn about z is known to
  // 1 mm / sqrt(2) over 2 m.
  const std::vector<TargetTie> two = {{"A", {}, g.centroid() + 2 * kX, 0.001},
                                      {"B", {}, g.centroid() - 2 * kX, 0.001}};
  const sensor::Matrix6d information = g.FromTargets(two);
  EXPECT_NEAR(information(2, 2), 2 * 4 / 1e-6, 1e-3 / 1e-6);
  EXPECT_NEAR(information(3, 3), 2 / 1e-6, 1);
  EXPECT_NEAR(information(0, 0), 0, 1e-3);  // nothing about the axis through both
}

}  // namespace
}  // namespace vantage::registration
