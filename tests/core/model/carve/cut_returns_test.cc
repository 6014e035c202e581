// Returns beyond the scanner's range or the site's limit: cut and counted, and no reason to refuse
// a scan.
#include "core/model/carve/cut_returns.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::model {
namespace {

// Every ray returns from a sphere around the scanner, m.
sensor::Scan Sphere(double range, double range_max) {
  sensor::Scan scan;
  scan.scanner.range_max = range_max;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(1);
  scan.image.native_azimuth_step = scan.image.native_elevation_step = sensor::Radians(1);
  for (int c = 0; c < 360; ++c) scan.image.azimuth.push_back(sensor::Radians(c + 0.5));
  for (int r = 0; r < 150; ++r) scan.image.elevation.push_back(sensor::Radians(r - 59.5));
  scan.image.range.assign(scan.image.cells(), static_cast<float>(range));
  return scan;
}

struct Outcome {
  MergeReport report;
  std::shared_ptr<const PlanningView> view;
};

Outcome Insert(const ModelConfig& config, const sensor::Scan& scan, const Eigen::Isometry3d& pose) {
  parallel::ThreadPool pool(2);
  auto model = PartialModel::Create(config).value();
  Outcome outcome;
  const auto report = model->Insert("scan", scan, pose, pool);
  EXPECT_TRUE(report.ok()) << report.status();
  if (report.ok()) outcome.report = *report;
  outcome.view = model->Publish();
  return outcome;
}

TEST(CutReturnsTest, OneFarReturnRefusesNothing) {
  const ClosedFormScene room = EmptyRoom();
  const Eigen::Isometry3d pose = PoseAt(room.stations[0]);
  sensor::Scan scan = ScanScene(room, pose, {});
  const Outcome before = Insert({}, scan, pose);
  // A level ray through a window: 49 m is within the site's 200 m to the sides, and was refused
  // since the site is 50 m high.
  const int row = static_cast<int>(std::lround(sensor::Radians(60) / sensor::Radians(0.4)));
  scan.image.range[scan.image.Index(10, row)] = 49;
  const Outcome after = Insert({}, scan, pose);
  EXPECT_EQ(after.report.beyond_range, 1u);
  EXPECT_EQ(after.report.beyond_site, 0u);
  EXPECT_EQ(after.report.samples, before.report.samples - 1);
  EXPECT_EQ(before.report.beyond_range, 0u);
  // Empty as far as the range model reaches, and unknown beyond for want of range.
  const Eigen::Vector3d direction = pose.linear() * scan.image.Direction(10, row);
  const double range_max = scan.scanner.range_max;
  EXPECT_TRUE(after.view->Empty(
      after.view->At(pose * Eigen::Vector3d::Zero() + (range_max - 0.1) * direction)));
  EXPECT_FALSE(
      after.view->Empty(after.view->At(pose.translation() + (range_max + 0.1) * direction)));
  EXPECT_EQ(after.view->State(after.view->At(pose.translation() + (range_max + 0.02) * direction)),
            VoxelState::kFalseImage);
  // Within its range and the site it is surface.
  scan.scanner.range_max = 60;
  const Outcome seen = Insert({}, scan, pose);
  EXPECT_EQ(seen.report.beyond_range + seen.report.beyond_site, 0u);
  EXPECT_EQ(seen.view->State(seen.view->At(pose.translation() + 49 * direction)),
            VoxelState::kTrueSurface);
}

// Brute force: a voxel is empty if its centre is within the site and in the field of view.
TEST(CutReturnsTest, ALongRangeScannerFillsTheSiteAndNoMore) {
  ModelConfig config;
  config.voxel_size = 0.25;
  config.max_half_extent = {30, 20, 8};
  const Eigen::Isometry3d pose = PoseAt({3, -2, 1.1}, 0.3);
  const Outcome outcome = Insert(config, Sphere(250, 270), pose);
  EXPECT_EQ(outcome.report.beyond_site, 360u * 150u);
  EXPECT_EQ(outcome.report.beyond_range, 0u);
  EXPECT_EQ(outcome.report.samples, 0u);
  size_t expected = 0;
  size_t differ = 0;
  const PlanningView& view = *outcome.view;
  for (int z = -40; z < 40; ++z) {
    for (int y = -90; y < 90; ++y) {
      for (int x = -130; x < 130; ++x) {
        const Eigen::Vector3d centre = view.Centre({x, y, z});
        const Eigen::Vector3d away = centre - pose.translation();
        const double elevation = std::asin(away.z() / away.norm());
        const bool inside = (centre.cwiseAbs().array() < config.max_half_extent.array()).all();
        // Within a row of the field's limit, and where the scanner stood, either is right.
        if (std::abs(elevation + sensor::Radians(60)) < sensor::Radians(1)) continue;
        if (away.head<2>().norm() < 1) continue;
        const bool empty = inside && elevation > -sensor::Radians(60);
        expected += empty ? 1 : 0;
        differ += empty != view.Empty({x, y, z}) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(expected, 1'000'000u);
  EXPECT_LT(differ, expected / 1000);
  // Nothing is wanted beyond the limit.
  const auto half = config.max_half_extent;
  view.ForEachSurface([&](const VoxelIndex& v, VoxelState, const SurfaceVoxel&) {
    const Eigen::Vector3d centre = view.Centre(v);
    EXPECT_TRUE((centre.cwiseAbs().array() < half.array()).all()) << centre.transpose();
  });
}

TEST(CutReturnsTest, TheNearerLimitCounts) {
  ModelConfig config;
  config.voxel_size = 0.25;
  config.max_half_extent = {30, 30, 12};
  const Outcome outcome = Insert(config, Sphere(100, 20), PoseAt({0, 0, 1}));
  // 11 m to the top, 30 m to the sides: rays steeper than asin(11 / 20) leave the site first.
  EXPECT_GT(outcome.report.beyond_range, 0u);
  EXPECT_GT(outcome.report.beyond_site, 0u);
  EXPECT_EQ(outcome.report.beyond_range + outcome.report.beyond_site, 360u * 150u);
  size_t site = 0;
  for (int r = 0; r < 150; ++r) {
    const double sine = std::sin(sensor::Radians(r - 59.5));
    if (11 < 20 * sine || 13 < -20 * sine) site += 360;
  }
  EXPECT_EQ(outcome.report.beyond_site, site);
}

TEST(CutReturnsTest, TheScannerItselfStandsInTheSite) {
  parallel::Serial serial;
  ModelConfig config;
  config.max_half_extent = {5, 5, 5};
  auto model = PartialModel::Create(config).value();
  const absl::Status refused =
      model->Insert("scan", Sphere(3, 20), PoseAt({0, 6, 0}), serial).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  EXPECT_NE(refused.message().find("(0, 6, 0)"), std::string::npos) << refused;
}

}  // namespace
}  // namespace vantage::model
