#include "client/cli/pose_flags.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/sensor/scanner_model.h"

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;

constexpr char kPoses[] =
    "# scan  4x4\n"
    "one 1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1\n"
    "\n"
    "two 0 -1 0 2.5  1 0 0 -1  0 0 1 0.5  0 0 0 1  # turned left\n";

TEST(PoseFlags, ReadsPosesByName) {
  const auto poses = ParsePoses(kPoses, "poses.txt");
  ASSERT_TRUE(poses.ok()) << poses.status();
  ASSERT_EQ(poses->size(), 2u);
  EXPECT_EQ((*poses)[1].first, "two");
  const Eigen::Vector3d ahead = (*poses)[1].second * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(ahead.isApprox(Eigen::Vector3d(2.5, 0, 0.5), 1e-12)) << ahead.transpose();
}

TEST(PoseFlags, BadPosesNameTheLine) {
  for (const auto& [text, why] : std::vector<std::pair<std::string, std::string>>{
           {"\none 1 2 3\n", "poses.txt:2: 4 words instead of 17"},
           {"one 1 0 0 0 0 1 0 0 0 0 1 x 0 0 0 1\n", "'x' is not a number"},
           {"one 1 0 0 0 0 1 0 0 0 0 1 nan 0 0 0 1\n", "'nan' is not a number"},
           {"one 2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n", "not a rigid transform"},
           {"one 1 0 0 0 0 1 0 0 0 0 -1 0 0 0 0 1\n", "not a rigid transform"}}) {
    const auto poses = ParsePoses(text, "poses.txt");
    EXPECT_EQ(poses.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(poses.status().message()), HasSubstr(why));
  }
}

TEST(PoseFlags, FlagGivesPositionAndHeading) {
  PoseFlags flags;
  flags.prior = {1, 2, 3, 90};
  const auto prior = PriorFrom(flags, "any");
  ASSERT_TRUE(prior.ok() && prior->has_value());
  const Eigen::Vector3d ahead = (*prior)->T_world_scan * Eigen::Vector3d::UnitX();
  EXPECT_TRUE(ahead.isApprox(Eigen::Vector3d(1, 3, 3), 1e-12)) << ahead.transpose();
  EXPECT_FALSE((*prior)->trusted);
  EXPECT_FALSE((*prior)->covariance.has_value());
}

TEST(PoseFlags, SigmaBecomesACovariance) {
  PoseFlags flags;
  flags.prior = {1, 2, 3, 90};
  flags.sigma = {0.1, 2};
  flags.levelled = 0.01;
  flags.trusted = true;
  const auto prior = PriorFrom(flags, "any");
  ASSERT_TRUE(prior.ok() && prior->has_value());
  EXPECT_NEAR((*(*prior)->covariance)(0, 0), sensor::Radians(2) * sensor::Radians(2), 1e-15);
  EXPECT_NEAR((*(*prior)->covariance)(5, 5), 0.01, 1e-15);
  EXPECT_NEAR(*(*prior)->levelled_sigma, sensor::Radians(0.01), 1e-15);
  EXPECT_TRUE((*prior)->trusted);
}

TEST(PoseFlags, ATrustedPoseSaysHowGoodItIs) {
  PoseFlags flags;
  flags.prior = {1, 2, 3, 90};
  flags.trusted = true;
  const absl::Status status = PriorFrom(flags, "any").status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(status.message().find("--trusted"), std::string::npos) << status;
}

TEST(PoseFlags, NothingGivenIsNoPrior) {
  const auto prior = PriorFrom(PoseFlags(), "any");
  ASSERT_TRUE(prior.ok());
  EXPECT_FALSE(prior->has_value());
}

TEST(PoseFlags, QualityWithoutAPoseIsRefused) {
  PoseFlags flags;
  flags.trusted = true;
  EXPECT_EQ(PriorFrom(flags, "any").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(PoseFlags, FileWithoutTheScanNamesThoseItHas) {
  const std::string path = ::testing::TempDir() + "/vantage_pose_flags_test.txt";
  std::ofstream(path) << kPoses;
  PoseFlags flags;
  flags.prior_file = path;
  EXPECT_TRUE(PriorFrom(flags, "two")->has_value());
  const auto missing = PriorFrom(flags, "three");
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr("no pose for 'three'"));
  flags.prior_file = "/nonexistent/poses.txt";
  EXPECT_EQ(PriorFrom(flags, "two").status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace vantage::cli
