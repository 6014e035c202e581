// What inserting a scan is said to take, against what it takes.
#include "core/model/insert_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/large_hall.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/support/resident_memory.h"

namespace vantage::model {
namespace {

sensor::Scan ScanOf(simulation::Scene (*scene)(uint64_t), double range, double step_degrees,
                    Eigen::Isometry3d& pose, parallel::Parallel& parallel) {
  const simulation::Scene at = scene(1);
  sensor::Scan scan;
  scan.scanner.range_max = range;
  scan.scanner.azimuth_step = scan.scanner.elevation_step = sensor::Radians(step_degrees);
  pose.translation() = at.starts.front();
  const simulation::SimulatedScanner tracer(at.mesh);
  scan.image = tracer.Scan(scan.scanner, pose, simulation::ScanFaults{}, 1, parallel);
  return scan;
}

// As far away in every direction.
sensor::Scan ScanOfSphere(int columns, int rows, double radius) {
  sensor::Scan scan;
  scan.scanner.range_max = 60;
  for (int c = 0; c < columns; ++c) {
    scan.image.azimuth.push_back(-sensor::kPi + c * 2 * sensor::kPi / columns);
  }
  const double step = sensor::Radians(150.0) / rows;
  for (int r = 0; r < rows; ++r) {
    scan.image.elevation.push_back(sensor::Radians(-60) + (r + 0.5) * step);
  }
  scan.image.native_azimuth_step = 2 * sensor::kPi / columns;
  scan.image.native_elevation_step = step;
  scan.image.range.assign(scan.image.cells(), static_cast<float>(radius));
  return scan;
}

struct Case {
  const char* name;
  simulation::Scene (*scene)(uint64_t);  // null: a sphere
  double range;                          // m, or the sphere's radius
  double step;                           // degrees
  double voxel;                          // m
};

class InsertEstimateOfScansTest : public testing::TestWithParam<Case> {};

TEST_P(InsertEstimateOfScansTest, IsWithinAFifthOfWhatInsertingTakes) {
  if (!test_support::ResetPeak()) GTEST_SKIP() << "the peak of memory is not known here";
  const Case& of = GetParam();
  parallel::ThreadPool pool(2);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const sensor::Scan scan =
      of.scene == nullptr
          ? ScanOfSphere(static_cast<int>(360 / of.step), static_cast<int>(150 / of.step), of.range)
          : ScanOf(of.scene, of.range, of.step, pose, pool);
  pose.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
  ModelConfig config;
  config.voxel_size = of.voxel;
  config.max_half_extent.z() = 100;
  const auto model = PartialModel::Create(config).value();
  ASSERT_TRUE(test_support::ResetPeak());
  const double before = test_support::ResidentMegabytes();
  // On one thread: the allocator keeps an arena for each, and how they fill is left to chance.
  parallel::Serial serial;
  const MergeReport report = model->Insert("scan", scan, pose, serial).value();
  const double peak = 1e6 * (test_support::PeakMegabytes() - before);
  const double kept = 1e6 * (test_support::ResidentMegabytes() - before);
  const InsertSize size(scan, config);
  const auto said_peak = static_cast<double>(size.PeakBytes());
  const auto said_kept = static_cast<double>(size.KeptBytes());
  const auto counted = static_cast<double>(model->Bytes());
  std::printf(
      "%zu surface voxels: %.1f MB at the peak, %.1f said; %.1f kept, %.1f said, %.1f counted\n",
      report.surface_voxels, peak / 1e6, said_peak / 1e6, kept / 1e6, said_kept / 1e6,
      counted / 1e6);
  constexpr double kMegabytes = 5e6;  // which the allocator may take or not
  EXPECT_LT(said_peak, 1.2 * peak + kMegabytes);
  EXPECT_GT(said_peak, peak / 1.2 - kMegabytes);
  EXPECT_LT(said_kept, 1.2 * kept + kMegabytes);
  EXPECT_GT(said_kept, kept / 1.2 - kMegabytes);
  EXPECT_LT(counted, 1.1 * kept + kMegabytes);
  EXPECT_GT(counted, kept / 1.1 - kMegabytes);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, InsertEstimateOfScansTest,
    testing::Values(Case{"Flat", simulation::FurnishedFlat, 20, 0.25, 0.05},
                    Case{"FlatFine", simulation::FurnishedFlat, 20, 0.25, 0.02},
                    Case{"FlatDense", simulation::FurnishedFlat, 20, 0.047, 0.05},
                    Case{"Hall", simulation::LargeHall, 130, 0.25, 0.1},
                    Case{"SmallSphere", nullptr, 15, 0.5, 0.05},
                    Case{"CoarseSphere", nullptr, 45, 0.5, 0.2}),
    [](const auto& of) { return of.param.name; });

// Few bytes of a scan may stand for much space: 8 kB as they are sent for this one.
TEST(InsertWithinMemoryTest, EndsBeforeMoreIsTaken) {
  parallel::ThreadPool pool(2);
  const sensor::Scan scan = ScanOfSphere(720, 300, 45);
  const auto model = PartialModel::Create({}).value();
  const sensor::Scan small = ScanOfSphere(90, 40, 3);
  ASSERT_TRUE(model->Insert("first", small, Eigen::Isometry3d::Identity(), pool).ok());
  const uint64_t digest = model->Digest();
  constexpr int64_t kLimit = 200 << 20;
  const bool peak_known = test_support::ResetPeak();
  const double before = test_support::ResidentMegabytes();
  const absl::Status refused =
      model->Insert("second", scan, Eigen::Isometry3d::Identity(), pool, kLimit).status();
  const double peak = 1e6 * (test_support::PeakMegabytes() - before);
  EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
  EXPECT_NE(refused.message().find("voxel_size"), absl::string_view::npos) << refused;
  if (peak_known) {
    EXPECT_LT(peak, static_cast<double>(kLimit));
  }
  EXPECT_EQ(model->Digest(), digest);
  EXPECT_EQ(model->version(), 1U);
  EXPECT_EQ(model->scans(), std::vector<std::string>{"first"});
  EXPECT_GT(InsertSize(scan, {}).PeakBytes(), int64_t{2} << 30);
}

}  // namespace
}  // namespace vantage::model
