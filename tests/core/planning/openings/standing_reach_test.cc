// What is out of reach from every floor that is known, against all places that the mesh has on it.
#include "core/planning/openings/standing_reach.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/simulation/scenes/outdoor_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/walkable_ground.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/three_scanners.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;

class StandingReachTest : public testing::Test {
 protected:
  static constexpr double kDensity = 400;      // samples / m^2
  static constexpr double kHeightStep = 0.25;  // m, between viewpoints over one another

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

  // Where a tripod can stand on floor that is known, at all heights.
  std::vector<Vector3d> Places(const FloorMap& floor) const {
    std::vector<Vector3d> places;
    const simulation::WalkableGround ground(tracer_, scene_.mesh.Bounds(), scene_.starts[0]);
    for (double height = config_.min_viewpoint_height;
         height <= config_.max_viewpoint_height + 1e-9; height += kHeightStep) {
      for (const Vector3d& place : ground.Stations(height, scanner_.clearance, 0.5)) {
        const model::VoxelIndex at = view_->At(place);
        if (!floor.columns().At(at.x(), at.y()).empty()) places.push_back(place);
      }
    }
    return places;
  }
  static bool Measures(const Vector3d& place, const sensor::ScannerModel& scanner,
                       const Vector3d& at, const Vector3d& normal, double density) {
    const Vector3d away = at - place;
    const double range = away.norm();
    const double cosine = -normal.dot(away) / range;
    return range <= scanner.range_max && cosine >= std::cos(scanner.max_incidence) &&
           scanner.SamplingDensityAtSine(away.z() / range, cosine, range) >= density;
  }

  simulation::Scene scene_;
  simulation::SimulatedScanner tracer_;
  parallel::Serial serial_;
  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
};

class StandingReachAtThreeScanners : public StandingReachTest,
                                     public testing::WithParamInterface<test_support::ScannerCase> {
 protected:
  StandingReachAtThreeScanners() {
    scanner_.azimuth_step = scanner_.elevation_step = GetParam().step;
    scanner_.range_noise = GetParam().noise;
  }
};

TEST_P(StandingReachAtThreeScanners, WhatAnyPlaceMeasuresIsWithinIt) {
  const FloorMap floor = FloorMap::Find(*view_, std::nullopt).value();
  const std::vector<Vector3d> places = Places(floor);
  ASSERT_GT(places.size(), 1000u);
  for (const double density : {25.0, kDensity, 2500.0}) {
    SCOPED_TRACE(density);
    StandingReach reach =
        StandingReach::Of(*view_, floor, std::span(&scanner_, 1), config_, {}).value();
    size_t at = 0;
    size_t attainable = 0;
    size_t out_of_reach = 0;
    size_t wrong = 0;
    view_->ForEachSurface([&](const model::VoxelIndex& voxel, model::VoxelState,
                              const model::SurfaceVoxel& surface) {
      if (at++ % 37 != 0) return;
      const bool has = reach.Has(voxel, surface, density);
      const bool measured = std::any_of(places.begin(), places.end(), [&](const Vector3d& place) {
        return Measures(place, scanner_, surface.centroid.cast<double>(),
                        surface.normal.cast<double>(), density);
      });
      attainable += measured;
      out_of_reach += !has;
      wrong += measured && !has;
    });
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(attainable, 100u);
    if (density > kDensity) {
      EXPECT_GT(out_of_reach, 50u);
    }
  }
}

// A tower beyond the street's end, whose faces lean every way: normals on both sides of a border
// between directions that are asked together, the worst first and then the best first.
TEST_P(StandingReachAtThreeScanners, TheOrderInWhichNormalsAreAskedDoesNotShow) {
  const FloorMap floor = FloorMap::Find(*view_, std::nullopt).value();
  const std::vector<Vector3d> places = Places(floor);
  // What the coarsest scanner has at the tower.
  const double density = GetParam().step > sensor::Radians(0.5) ? 2 : 20;
  const Vector3d middle = scene_.mesh.Bounds().center();
  const double end = scene_.mesh.Bounds().max().x();
  std::mt19937_64 random(3);
  std::normal_distribution<double> any(0, 1);
  size_t attainable = 0;
  size_t out_of_reach = 0;
  for (const Vector3d& top :
       {Vector3d(end + 15, middle.y(), 6), Vector3d(end + 20, middle.y(), 9)}) {
    const model::VoxelIndex voxel = view_->At(top);
    const Vector3d at = view_->Centre(voxel);
    const Vector3d nearest =
        *std::min_element(places.begin(), places.end(), [&](const Vector3d& a, const Vector3d& b) {
          return (a - at).squaredNorm() < (b - at).squaredNorm();
        });
    std::vector<Vector3d> normals;
    normals.reserve(1000);
    for (int i = 0; i < 1000; ++i) {
      normals.push_back(Vector3d(any(random), any(random), any(random)).normalized());
    }
    std::sort(normals.begin(), normals.end(), [&](const Vector3d& a, const Vector3d& b) {
      return a.dot(nearest - at) < b.dot(nearest - at);
    });
    std::vector<bool> by_order[2];
    for (std::vector<bool>& has : by_order) {
      StandingReach reach =
          StandingReach::Of(*view_, floor, std::span(&scanner_, 1), config_, {}).value();
      for (const Vector3d& normal : normals) {
        model::SurfaceVoxel surface;
        surface.normal = normal.cast<float>();
        has.push_back(reach.Has(voxel, surface, density));
        if (has.back()) continue;
        ++out_of_reach;
        EXPECT_TRUE(std::none_of(
            places.begin(), places.end(),
            [&](const Vector3d& place) { return Measures(place, scanner_, at, normal, density); }))
            << top.transpose() << " facing " << normal.transpose();
      }
      for (const Vector3d& normal : normals) {
        attainable += Measures(nearest, scanner_, at, normal, density) ? 1 : 0;
      }
      std::reverse(normals.begin(), normals.end());
    }
    std::reverse(by_order[1].begin(), by_order[1].end());
    EXPECT_EQ(by_order[0], by_order[1]);
  }
  EXPECT_GT(attainable, 500u);
  EXPECT_GT(out_of_reach, 500u);
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, StandingReachAtThreeScanners,
                         testing::ValuesIn(test_support::kThreeScanners));

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

// A wall at x = 12 that is 5 m high, 3 m behind a screen that is `screen` m high, in front of which
// all floor lies; the sky is above. Nothing of the wall has been measured densely enough.
model::PlanningView WallBehindScreen(double screen) {
  constexpr double kVoxel = 0.1;
  std::vector<model::BrickAt> bricks;
  for (int bz = 0; bz < 8; ++bz) {
    for (int by = 0; by < 8; ++by) {
      for (int bx = 0; bx < 16; ++bx) {
        auto brick = std::make_shared<model::Brick>();
        for (int local = 0; local < model::Brick::kVoxels; ++local) {
          const model::VoxelIndex v = model::PlanningView::Global({bx, by, bz}, local);
          const Vector3d p = (v.cast<double>().array() + 0.5) * kVoxel;
          const bool floor = p.z() < kVoxel && p.x() < 8.8;
          const bool in_screen = p.x() > 9 && p.x() < 9.1 && p.z() < screen;
          const bool wall = p.x() > 12 && p.x() < 12.1 && p.z() < 5;
          const bool air = p.x() < 12 && p.z() > kVoxel && p.z() < 6;
          model::VoxelState& state = brick->state[static_cast<size_t>(local)];
          if (air) state = model::VoxelState::kEmpty;
          if (!floor && !in_screen && !wall) continue;
          state = model::VoxelState::kTrueSurface;
          model::SurfaceVoxel surface;
          surface.centroid = p.cast<float>();
          surface.normal =
              floor ? Eigen::Vector3f::UnitZ().eval() : (-Eigen::Vector3f::UnitX()).eval();
          surface.area = static_cast<float>(kVoxel * kVoxel);
          surface.samples = 1;
          surface.density = wall ? 10 : 1000;
          brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
          brick->surface.push_back(surface);
        }
        bricks.push_back({{bx, by, bz}, std::move(brick)});
      }
    }
  }
  return {kVoxel, 1, std::move(bricks), {test_support::MakeStation({2, 3, 1.6})}};
}

// Of a wall behind a screen the part counts that is seen over it from somewhere.
TEST(StandingReachInClosedFormTest, WhatIsHiddenFromAllFloorIsLeftOut) {
  sensor::ScannerModel scanner;
  scanner.range_max = 40;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.2);
  PlanningConfig config;
  config.required_density = 100;
  for (const double screen : {0.0, 2.5, 3.5}) {
    SCOPED_TRACE(screen);
    const model::PlanningView view = WallBehindScreen(screen);
    const Coverage coverage = MeasureCoverage(view, std::span(&scanner, 1), config).value();
    // Over the screen from the highest place farthest behind, half a metre from the floor's end.
    // The two lowest rows of voxels count as hidden: rays to the lowest would aim at no air.
    const double seen_from =
        screen > 0 ? screen + (screen - config.max_viewpoint_height - 0.1) * 3 / 8.6 : 0;
    EXPECT_NEAR(coverage.area_out_of_reach, 6.4 * seen_from, 0.15 * 6.4 * screen + 1.3);
  }
}

}  // namespace
}  // namespace vantage::planning
