// What is out of reach from every floor that is known, against all places that the mesh has on it.
#include "core/planning/openings/standing_reach.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/walkable_ground.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;

class StandingReachTest : public testing::Test {
 protected:
  static constexpr double kDensity = 400;  // samples / m^2

  StandingReachTest() : scene_(simulation::StreetScene(1)), tracer_(scene_.mesh) {
    scanner_.range_max = 40;
    scanner_.azimuth_step = scanner_.elevation_step = sensor::Radians(0.5);
    config_.required_density = kDensity;
    model::ModelConfig coarse;
    coarse.voxel_size = 0.1;
    model_ = model::PartialModel::Create(coarse).value();
    for (size_t i = 0; i < scene_.starts.size(); ++i) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translate(scene_.starts[i]);
      sensor::Scan scan;
      scan.scanner = scanner_;
      scan.image = tracer_.Scan(scanner_, pose, {}, i + 1, serial_);
      EXPECT_TRUE(model_->Insert("scan" + std::to_string(i), scan, pose, serial_).ok());
    }
    view_ = model_->Publish();
  }

  simulation::Scene scene_;
  simulation::SimulatedScanner tracer_;
  parallel::Serial serial_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
};

TEST_F(StandingReachTest, WhatAnyPlaceMeasuresIsWithinIt) {
  const FloorMap floor = FloorMap::Find(*view_, std::nullopt).value();
  StandingReach reach =
      StandingReach::Of(*view_, floor, std::span(&scanner_, 1), config_, {}).value();
  std::vector<Vector3d> places;
  const simulation::WalkableGround ground(tracer_, scene_.mesh.Bounds(), scene_.starts[0]);
  for (const double height : {config_.min_viewpoint_height, config_.max_viewpoint_height}) {
    for (const Vector3d& place : ground.Stations(height, scanner_.clearance, 0.5)) {
      const model::VoxelIndex at = view_->At(place);
      if (!floor.columns().At(at.x(), at.y()).empty()) places.push_back(place);
    }
  }
  ASSERT_GT(places.size(), 500u);
  size_t at = 0;
  size_t attainable = 0;
  size_t out_of_reach = 0;
  size_t wrong = 0;
  view_->ForEachSurface(
      [&](const model::VoxelIndex& voxel, model::VoxelState, const model::SurfaceVoxel& surface) {
        if (at++ % 17 != 0) return;
        const bool measured = std::any_of(places.begin(), places.end(), [&](const Vector3d& place) {
          const Vector3d away = surface.centroid.cast<double>() - place;
          const double range = away.norm();
          const double cosine = -surface.normal.cast<double>().dot(away) / range;
          return range <= scanner_.range_max && cosine >= std::cos(scanner_.max_incidence) &&
                 scanner_.SamplingDensityAtSine(away.z() / range, cosine, range) >= kDensity;
        });
        const bool has = reach.Has(voxel, surface, kDensity);
        attainable += measured;
        out_of_reach += !has;
        wrong += measured && !has;
      });
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(attainable, 1000u);
  EXPECT_GT(out_of_reach, 100u);
}

// Roofs that rise away from the street are met askew from everywhere on it.
TEST_F(StandingReachTest, CoverageLeavesItOutAndSaysHowMuch) {
  const Coverage coverage = MeasureCoverage(*view_, std::span(&scanner_, 1), config_).value();
  EXPECT_GT(coverage.area_out_of_reach, 20);
  double all = -coverage.area_given_up - coverage.area_out_of_reach;
  for (const double area : coverage.area) all += area;
  EXPECT_NEAR(coverage.estimated_coverage.value(), coverage.area_at_density / all, 1e-9);
}

// A model without a floor says nothing of where one stands.
TEST_F(StandingReachTest, WithoutAFloorNothingIsExcluded) {
  const model::PlanningView nothing(0.1, 0, {}, {});
  const FloorMap none = FloorMap::Find(nothing, std::nullopt).value();
  StandingReach reach =
      StandingReach::Of(nothing, none, std::span(&scanner_, 1), config_, {}).value();
  model::SurfaceVoxel up;
  up.normal = Eigen::Vector3f::UnitZ();
  EXPECT_TRUE(reach.Has({0, 0, 1000}, up, kDensity));
}

}  // namespace
}  // namespace vantage::planning
