// The skyline behind false surface, against every measured voxel of the model.
#include "core/planning/patches/skyline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "core/planning/openings/measure_coverage.h"
#include "core/planning/patches/patches.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;
using model::VoxelState;

constexpr double kYardVoxel = 0.1;

// The model of x in [0, 20), y in [0, 4), z in [0, 6) m, by voxel centres; above and around it
// nothing is known, and the sky begins above what is empty.
model::PlanningView Build(const std::function<VoxelState(const Vector3d&)>& state_at) {
  std::vector<model::BrickAt> bricks;
  for (int bz = 0; bz < 8; ++bz) {
    for (int by = 0; by < 5; ++by) {
      for (int bx = 0; bx < 25; ++bx) {
        auto brick = std::make_shared<model::Brick>();
        for (int local = 0; local < model::Brick::kVoxels; ++local) {
          const model::VoxelIndex v = model::PlanningView::Global({bx, by, bz}, local);
          const Vector3d p = (v.cast<double>().array() + 0.5) * kYardVoxel;
          VoxelState& state = brick->state[static_cast<size_t>(local)];
          state = p.z() < 6 ? state_at(p) : VoxelState::kUnknown;
          if (!model::HasArea(state)) continue;
          model::SurfaceVoxel surface;
          surface.centroid = p.cast<float>();
          surface.normal = -Eigen::Vector3f::UnitX();
          surface.area = static_cast<float>(kYardVoxel * kYardVoxel);
          brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
          brick->surface.push_back(surface);
        }
        bricks.push_back({{bx, by, bz}, std::move(brick)});
      }
    }
  }
  return {kYardVoxel, 1, std::move(bricks), {test_support::MakeStation({2, 2, 1.5})}};
}

// False surface stands upright at x = 5, unknown space is behind it up to a wall at x = 12 that is
// `wall` m high.
VoxelState Yard(const Vector3d& p, double wall) {
  if (p.z() < 0.1) return VoxelState::kTrueSurface;
  if (p.x() > 12 && p.x() < 12.2 && p.z() < wall) return VoxelState::kTrueSurface;
  if (p.z() > 5) return VoxelState::kEmpty;
  if (p.x() < 5) return VoxelState::kEmpty;
  if (p.x() < 5.1) return VoxelState::kFalseOcclusion;
  return p.x() < 12 ? VoxelState::kUnknown : VoxelState::kEmpty;
}

constexpr int kAhead = 0;  // along +x, as the false surface's unknown side

TEST(SkylineTest, IsTheSlopeToWhatRisesBehind) {
  for (const double wall : {0.5, 2.0, 4.5}) {
    const model::PlanningView view = Build([&](const Vector3d& p) { return Yard(p, wall); });
    Skyline skyline = Skyline::Of(view).value();
    for (const double z : {0.55, 1.55, 3.05}) {
      const model::VoxelIndex voxel = view.At({5.05, 2.05, z});
      // The wall, or the ground beyond it, which goes on as far as x = 20.
      const double slope = std::max((wall - z) / 7.05, (0.1 - z) / 14.95);
      // A column of bricks is 0.8 m wide.
      EXPECT_NEAR(skyline.Around(voxel).sine[kAhead] / 126.0, std::sin(std::atan(slope)),
                  0.15 * std::abs(slope) + 0.02)
          << wall << " " << z;
      EXPECT_EQ(skyline.InSky(voxel, -Eigen::Vector3f::UnitX()), z > 2.5 && wall < z);
      // The other way lies the station's side: level ground.
      EXPECT_LT(skyline.Around(voxel).sine[SkylineSines::kDirections / 2], 0);
    }
  }
}

// A column that stands to one side of the middle of a sixteenth rises there all the same.
TEST(SkylineTest, LooksToBothSidesOfADirection) {
  const Vector3d from(5.05, 2.05, 1.55);
  for (const double aside : {-0.25, 0.25}) {
    // 10 m away, 1 m wide, 4 degrees and more from the middle of what lies ahead.
    const double azimuth = aside * 2 * sensor::kPi / SkylineSines::kDirections;
    const Eigen::Vector2d column =
        from.head<2>() + 10 * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
    const model::PlanningView view = Build([&](const Vector3d& p) {
      const Eigen::Vector2d off = (p.head<2>() - column).cwiseAbs();
      if (p.z() < 4.5 && off.x() < 0.5 && off.y() < 0.5) return VoxelState::kTrueSurface;
      return Yard(p, 0);
    });
    Skyline skyline = Skyline::Of(view).value();
    EXPECT_GT(skyline.Around(view.At(from)).sine[kAhead] / 126.0, 0.2) << aside;
  }
}

TEST(SkylineTest, UnderARoofEverythingIsCovered) {
  const model::PlanningView view =
      Build([&](const Vector3d& p) { return p.z() > 5.9 ? VoxelState::kTrueSurface : Yard(p, 1); });
  Skyline skyline = Skyline::Of(view).value();
  for (const double z : {0.55, 3.05}) {
    const model::VoxelIndex voxel = view.At({5.05, 2.05, z});
    EXPECT_TRUE(skyline.Around(voxel).covered());
    EXPECT_FALSE(skyline.InSky(voxel, -Eigen::Vector3f::UnitX()));
  }
  // A canopy covers what is below it and nothing else.
  const model::PlanningView canopy = Build([&](const Vector3d& p) {
    return p.y() < 1.6 && p.z() > 4 && p.z() < 4.1 ? VoxelState::kTrueSurface : Yard(p, 1);
  });
  Skyline below = Skyline::Of(canopy).value();
  EXPECT_TRUE(below.Around(canopy.At({5.05, 0.45, 3.05})).covered());
  EXPECT_FALSE(below.Around(canopy.At({5.05, 2.85, 3.05})).covered());
}

TEST(SkylineTest, WhatLiesInTheSkyIsNoSurface) {
  const model::PlanningView view = Build([&](const Vector3d& p) { return Yard(p, 1); });
  PlanningConfig config;
  const PatchSet patches = ExtractPatches(view, config).value();
  double highest = 0;
  for (const DeficientCell& cell : patches.cells) {
    if (cell.kind == model::SurfaceKind::kTrue) continue;
    highest = std::max(highest, static_cast<double>(cell.position.z()));
  }
  // As high as a viewpoint may be: a metre over the one there was.
  EXPECT_NEAR(highest, 2.5, kYardVoxel);
  const Coverage coverage = MeasureCoverage(view, {}, config).value();
  EXPECT_NEAR(coverage.area[static_cast<size_t>(model::SurfaceKind::kOcclusion)], 4 * 2.4, 0.5);
}

}  // namespace
}  // namespace vantage::planning
