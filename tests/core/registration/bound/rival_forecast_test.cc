// What is foreseen of scans in a room of which the site has another just like it.
#include "core/registration/bound/rival_forecast.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/registration/bound/overlap_element.h"
#include "core/registration/bound/registration_result.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

const Eigen::Vector3d kStation(0.4, 0.5, 1.4);
const Eigen::Vector3d kView(-0.6, -0.3, 1.45);

// A furnished room, and the same again where `other` puts it.
std::shared_ptr<const model::PlanningView> TwoRooms(const Eigen::Isometry3d& other) {
  const BoxScene scene = FurnishedRoom(4);
  ViewBuilder builder(0.05);
  constexpr double kStep = sensor::Radians(0.5);
  for (double elevation = -1.3; elevation < 1.5; elevation += kStep) {
    for (double azimuth = 0; azimuth < 2 * sensor::kPi; azimuth += kStep) {
      const Eigen::Vector3d direction(std::cos(azimuth) * std::cos(elevation),
                                      std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
      const BoxScene::Hit hit = scene.Cast(kStation, direction);
      if (!(hit.range > 0)) continue;
      const Eigen::Vector3d point = kStation + hit.range * direction;
      builder.AddSample(kStation, point, hit.normal);
      builder.AddSample(other * kStation, other * point, other.linear() * hit.normal);
    }
  }
  return builder.Build();
}

// Of the room at the origin.
std::vector<OverlapElement> Overlap(const model::PlanningView& model) {
  std::vector<OverlapElement> elements;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        const Eigen::Vector3d at = voxel.centroid.cast<double>();
        if (state != model::VoxelState::kTrueSurface || at.head<2>().norm() > 4) return;
        if (at.z() > 2.9) return;  // the storey above
        if (voxel.normal.cast<double>().dot(kView - at) <= 0) return;
        elements.push_back({voxel.centroid, voxel.normal, 3, voxel.samples});
      });
  return elements;
}

std::vector<RivalPose> RivalsOf(const model::PlanningView& model, double position_sigma,
                                double heading_sigma) {
  RegistrationConfig config;
  config.prior_sigma = position_sigma;
  config.prior_heading_sigma = heading_sigma;
  return RivalForecast(model).Rivals(Overlap(model), kView, sensor::ScannerModel(), config);
}

Eigen::Isometry3d EightMetresOn(double turn) {
  Eigen::Isometry3d other = Eigen::Isometry3d::Identity();
  other.translate(Eigen::Vector3d(8, 0, 0));
  other.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()));
  return other;
}

// A prior of two metres allows 9.5 m: farther than four thousand shifts of three voxels reach.
TEST(RivalForecast, FindsATwinAsFarAsPriorsMayBeWrong) {
  const auto model = TwoRooms(EightMetresOn(0));
  const std::vector<RivalPose> rivals = RivalsOf(*model, 2, 0);
  ASSERT_FALSE(rivals.empty());
  EXPECT_NEAR(rivals.front().distance, 8, 0.02);
  EXPECT_NEAR(rivals.front().farthest, 8, 0.05);
  EXPECT_GT(rivals.front().fit_share, 0.95);
  EXPECT_TRUE(RivalsOf(*model, 1, 0).empty());
  EXPECT_TRUE(RivalsOf(*model, 0, 0).empty());
}

// The room above is just the same: as far up as priors reach, of one storey and half another.
TEST(RivalForecast, FindsATwinOnTheNextStorey) {
  Eigen::Isometry3d above = Eigen::Isometry3d::Identity();
  above.translate(Eigen::Vector3d(0.4, 0, 3.05));
  const auto model = TwoRooms(above);
  const std::vector<RivalPose> rivals = RivalsOf(*model, 1, 0);
  ASSERT_FALSE(rivals.empty());
  EXPECT_LT((rivals.front().T_world_scan.translation() - above * kView).norm(), 0.02);
  EXPECT_TRUE(RivalsOf(*model, 0.3, 0).empty());
  EXPECT_TRUE(RivalsOf(*model, 0, 0).empty());
}

TEST(RivalForecast, FindsATurnedTwinWhereHeadingsAreNotKnown) {
  const double turn = sensor::Radians(100);
  const auto model = TwoRooms(EightMetresOn(turn));
  const std::vector<RivalPose> rivals = RivalsOf(*model, 2, sensor::kPi);
  ASSERT_FALSE(rivals.empty());
  const Eigen::Isometry3d& at = rivals.front().T_world_scan;
  EXPECT_NEAR(std::atan2(at.linear()(1, 0), at.linear()(0, 0)), turn, 0.01);
  EXPECT_LT((at.translation() - EightMetresOn(turn) * kView).norm(), 0.03);
  EXPECT_GT(rivals.front().farthest, rivals.front().distance);
  // To 100 degrees at four and a half sigma.
  EXPECT_FALSE(RivalsOf(*model, 2, sensor::Radians(25)).empty());
  EXPECT_TRUE(RivalsOf(*model, 2, sensor::Radians(15)).empty());
  EXPECT_TRUE(RivalsOf(*model, 2, 0).empty());
}

TEST(RivalForecast, TargetsRefuteATwin) {
  const auto model = TwoRooms(EightMetresOn(0));
  RegistrationConfig config;
  config.prior_sigma = 2;
  std::vector<TargetTie> targets(2);
  targets[0].in_world = {1, 2.4, 1.2};
  targets[1].in_world = {-2, -2.4, 1.2};
  EXPECT_TRUE(RivalForecast(*model)
                  .Rivals(Overlap(*model), kView, sensor::ScannerModel(), config, targets)
                  .empty());
}

}  // namespace
}  // namespace vantage::registration
