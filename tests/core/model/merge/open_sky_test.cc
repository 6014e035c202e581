// What one scan sees in the sky is no false surface in any brick, whichever scan sees the brick,
// and whether the scan comes first or last or goes again.
#include "core/model/merge/open_sky.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/model/carve/carve.h"
#include "core/model/merge/brick_set.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::model {
namespace {

using Eigen::Vector3d;

// A street whose ground ends all around, scanned from its middle and from beside its houses, from
// where rays pass over their roofs and go down into the sky.
class OpenSkyTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const simulation::Scene street = simulation::StreetScene(1);
    const simulation::SimulatedScanner tracer(street.mesh);
    sensor::ScannerModel scanner;
    scanner.range_max = 30;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(1.2);
    parallel::ThreadPool pool(2);
    scans_ = new std::vector<Made>;
    std::vector<Vector3d> places = {street.starts[0], street.starts[0] + Vector3d(1.5, 0, 0)};
    // Around the first start, as far as its houses stand, where there is ground.
    for (int k = 0; k < 24 && places.size() < 5; ++k) {
      const double azimuth = 0.7 + 1.9 * k;
      const Vector3d above =
          street.starts[0] + Vector3d(8 * std::cos(azimuth), 8 * std::sin(azimuth), 20);
      const auto met = tracer.tracer().Trace(above.cast<float>(), {0, 0, -1}, 0);
      const Vector3d ground = above - Vector3d(0, 0, met.distance);
      if (!met.hit || std::abs(ground.z() - street.floor_height) > 1) continue;
      places.push_back(ground + Vector3d(0, 0, 1.6));
    }
    ASSERT_EQ(places.size(), 5u);
    for (size_t i = 0; i < places.size(); ++i) {
      Made made;
      made.pose.translate(places[i]);
      made.pose.rotate(Eigen::AngleAxisd(0.4 + static_cast<double>(i), Vector3d::UnitZ()));
      made.scan.scanner = scanner;
      made.scan.image = tracer.Scan(scanner, made.pose, {}, i + 1, pool);
      scans_->push_back(made);
    }
  }

  static void TearDownTestSuite() { delete scans_; }

  static ModelConfig Config() {
    ModelConfig config;
    config.voxel_size = 0.15;
    return config;
  }

  static std::string Name(size_t i) { return "scan" + std::to_string(i); }

  void Insert(size_t i, PartialModel& model) {
    const absl::StatusOr<MergeReport> report =
        model.Insert(Name(i), (*scans_)[i].scan, (*scans_)[i].pose, pool_);
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_GT(report->sky_rays, 3'000u);
  }

  std::unique_ptr<PartialModel> Of(const std::vector<size_t>& scans) {
    std::unique_ptr<PartialModel> model = PartialModel::Create(Config()).value();
    for (const size_t i : scans) Insert(i, *model);
    return model;
  }

  struct Made {
    sensor::Scan scan;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  };
  static std::vector<Made>* scans_;
  parallel::ThreadPool pool_{2};
};

std::vector<OpenSkyTest::Made>* OpenSkyTest::scans_ = nullptr;

TEST_F(OpenSkyTest, WhatAnyScanSeesInTheSkyIsNoFalseSurface) {
  const std::unique_ptr<PartialModel> model = Of({0, 1, 2, 3, 4});
  const std::shared_ptr<const PlanningView> view = model->Publish();
  std::vector<std::unique_ptr<ScanLayer>> layers;
  for (const Made& made : *scans_) {
    layers.push_back(Carve(made.scan, made.pose, Config(), pool_));
  }
  size_t in_sky = 0;
  size_t false_surface = 0;
  view->ForEachSurface([&](const VoxelIndex& voxel, VoxelState state, const SurfaceVoxel&) {
    if (!IsFalseSurface(state)) return;
    ++false_surface;
    in_sky += std::any_of(layers.begin(), layers.end(), [&](const auto& layer) {
      return layer->InSky(view->Centre(voxel), Config().voxel_size);
    });
  });
  EXPECT_EQ(in_sky, 0u);
  EXPECT_GT(false_surface, 100u);  // behind the hut and the boulders
}

// A scan clears false surface in bricks of which it holds nothing itself: otherwise the two tests
// below would show nothing.
TEST_F(OpenSkyTest, AScanClearsBricksThatItHoldsNothingOf) {
  size_t beyond = 0;
  for (size_t last = 0; last < scans_->size(); ++last) {
    std::vector<size_t> others;
    for (size_t i = 0; i < scans_->size(); ++i) {
      if (i != last) others.push_back(i);
    }
    const std::shared_ptr<const PlanningView> before = Of(others)->Publish();
    ModelOctree octree(Config().voxel_size);
    for (const BrickAt& at : before->bricks()) octree.Set(at.brick, at.contents);
    const std::unique_ptr<ScanLayer> layer =
        Carve((*scans_)[last].scan, (*scans_)[last].pose, Config(), pool_);
    BrickSet own;
    for (const auto& [key, brick] : layer->bricks.own()) own.Add(BrickOf(key));
    for (const auto& [page, bricks] : layer->bricks.empty()) own.Add(page, bricks);
    const BrickSet near = own.Grown();
    for (const BrickKey key : BricksThatSkyClears(*layer, octree, Config().voxel_size)) {
      beyond += near.Has(BrickOf(key)) ? 0 : 1;
    }
  }
  EXPECT_GT(beyond, 0u);
}

TEST_F(OpenSkyTest, TheOrderDoesNotShow) {
  std::vector<size_t> order = {0, 1, 2, 3, 4};
  const uint64_t digest = Of(order)->Digest();
  for (int turn = 0; turn < 4; ++turn) {
    std::rotate(order.begin(), order.begin() + 1, order.end());
    EXPECT_EQ(Of(order)->Digest(), digest) << "from scan " << order.front();
  }
  std::reverse(order.begin(), order.end());
  EXPECT_EQ(Of(order)->Digest(), digest);
}

TEST_F(OpenSkyTest, WhatGoesLeavesNoTrace) {
  const std::unique_ptr<PartialModel> model = Of({0, 1, 2, 3, 4});
  const uint64_t all = model->Digest();
  for (size_t gone = 0; gone < scans_->size(); ++gone) {
    ASSERT_TRUE(model->Withdraw(Name(gone), pool_).ok());
    std::vector<size_t> others;
    for (size_t i = 0; i < scans_->size(); ++i) {
      if (i != gone) others.push_back(i);
    }
    EXPECT_EQ(model->Digest(), Of(others)->Digest()) << "without scan " << gone;
    Insert(gone, *model);
    EXPECT_EQ(model->Digest(), all) << "with scan " << gone << " again";
  }
}

}  // namespace
}  // namespace vantage::model
