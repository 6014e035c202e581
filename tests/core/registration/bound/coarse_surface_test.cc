// What is ruled out for squares of shifts, beside what a sample finds at each of them.
#include "core/registration/bound/coarse_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "core/registration/align/voxel_search.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

constexpr double kReach = 2.5;  // voxels

class CoarseSurfaceTest : public testing::Test {
 protected:
  std::shared_ptr<const model::PlanningView> model_ =
      ModelFromScan(FurnishedRoom(4), PoseAt({0.4, 0.5, 1.4}, 0.3), {}, 11);
  const double h_ = model_->voxel_size();
  const CoarseSurface coarse_{*model_, 3 * h_, kReach* h_};
  const VoxelSearch search_{*model_,
                            {Eigen::Vector3d::Constant(-10), Eigen::Vector3d::Constant(10)}};
};

TEST_F(CoarseSurfaceTest, NeverRulesOutWhatASampleFinds) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> at(-5, 5);
  std::uniform_real_distribution<double> angle(0, 2 * sensor::kPi);
  size_t found = 0;
  size_t ruled_out = 0;
  size_t squares = 0;
  for (int k = 0; k < 4000; ++k) {
    const Eigen::Vector3d point(at(random), at(random), 1.3 + 0.3 * at(random));
    const double azimuth = angle(random);
    const Eigen::Vector3d normal = k % 4 == 0
                                       ? Eigen::Vector3d(0, 0, k % 8 == 0 ? 1 : -1)
                                       : Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0);
    const uint8_t facing = CoarseSurface::Facing(normal);
    for (int level = 0; level < CoarseSurface::kLevels; ++level) {
      bool any = false;
      for (int j = 0; !any && j < CoarseSurface::Side(level); ++j) {
        for (int i = 0; !any && i < CoarseSurface::Side(level); ++i) {
          any = search_.FindsAny(point + coarse_.step() * Eigen::Vector3d(i, j, 0), normal, kReach);
        }
      }
      const bool may = coarse_.MayLieOn(level, point, facing);
      ASSERT_TRUE(may || !any) << "level " << level << " at " << point.transpose();
      found += any ? 1 : 0;
      ruled_out += may ? 0 : 1;
      ++squares;
    }
  }
  EXPECT_GT(found, squares / 50);
  EXPECT_GT(ruled_out, squares / 3);
}

TEST_F(CoarseSurfaceTest, OfNothingKnownNothingIsHeld) {
  const model::PlanningView nothing(0.05, 1, {}, {});
  const CoarseSurface coarse(nothing, 0.15, 0.125);
  EXPECT_FALSE(coarse.MayLieOn(0, {0, 0, 0}, 0xff));
  EXPECT_FALSE(coarse_.MayLieOn(2, {std::nan(""), 0, 0}, 0xff));
}

}  // namespace
}  // namespace vantage::registration
