// Shafts against walking single segments, and both forms of the grid against each other.
#include "core/visibility/shaft.h"

#include <gtest/gtest.h>

#include <random>

#include "core/visibility/voxel_walk.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/runs.h"

namespace vantage::visibility {
namespace {

class ShaftTest : public ::testing::Test {
 protected:
  ShaftTest() : model_(test_support::BuildView(test_support::FurnishedRoom(7))), grid_(model_) {}

  double Uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  // A box of up to `most` voxels a side.
  Eigen::AlignedBox3d Somewhere(double most) {
    const Eigen::Vector3d size = (grid_.box().max - grid_.box().min).cast<double>();
    Eigen::AlignedBox3d box;
    for (int a = 0; a < 3; ++a) {
      const double side = random_() % 3 == 0 ? 0 : std::floor(most * Uniform());
      // Often on the lattice, as viewcells' centres are.
      double low = 1 + (size[a] - side - 3) * Uniform();
      if (random_() % 2 == 0) low = std::floor(low);
      box.min()[a] = low;
      box.max()[a] = low + side;
    }
    return box;
  }
  Eigen::Vector3d In(const Eigen::AlignedBox3d& box) {
    return box.min() + box.sizes().cwiseProduct(Eigen::Vector3d(Uniform(), Uniform(), Uniform()));
  }
  static Eigen::Vector3d Corner(const Eigen::AlignedBox3d& box, int i) {
    return box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
  }
  // Whether the segment meets no opaque voxel.
  bool Clear(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    return WalkVoxels(from, to, [&](const model::VoxelIndex& v, double) {
      return grid_.Empty(v + grid_.box().min);
    });
  }

  std::mt19937_64 random_{9};
  model::PlanningView model_;
  OpaqueGrid grid_;
  parallel::Serial serial_;
  OpaqueGrid summed_{grid_.Summed(serial_).value()};
};

TEST_F(ShaftTest, WhatIsDecidedHoldsForEverySegment) {
  int hidden = 0;
  int visible = 0;
  int open = 0;
  constexpr int kShafts = test_support::Runs(60000);
  for (int k = 0; k < kShafts; ++k) {
    const double most = k % 2 == 0 ? 6 : 24;
    const Eigen::AlignedBox3d views = Somewhere(most);
    const Eigen::AlignedBox3d targets = Somewhere(most);
    const Hidden occlusion = Occlusion(grid_, views, targets);
    const bool entirely = EntirelyVisible(grid_, views, targets);
    ASSERT_EQ(Occlusion(summed_, views, targets), occlusion) << "shaft " << k;
    ASSERT_EQ(EntirelyVisible(summed_, views, targets), entirely) << "shaft " << k;
    open += occlusion == Hidden::kNone;
    ASSERT_FALSE(entirely && occlusion == Hidden::kAll);
    if (occlusion != Hidden::kAll && !entirely) continue;
    (entirely ? visible : hidden) += 1;
    for (int ray = 0; ray < 25; ++ray) {
      const Eigen::Vector3d from = ray < 8 ? Corner(views, ray) : In(views);
      const Eigen::Vector3d to = ray < 8 ? Corner(targets, 7 - ray) : In(targets);
      ASSERT_EQ(Clear(from, to), entirely)
          << "shaft " << k << " from " << from.transpose() << " to " << to.transpose();
    }
  }
  EXPECT_GT(hidden, kShafts / 100);
  EXPECT_GT(visible, kShafts / 100);
  EXPECT_GT(open, kShafts / 100);
}

TEST_F(ShaftTest, VisibleIsMissedForSomethingInTheWay) {
  // Not visible: a dense sample of segments finds what is in the way nearly always.
  int not_visible = 0;
  int nothing_found = 0;
  for (int k = 0; k < test_support::Runs(4000); ++k) {
    const Eigen::AlignedBox3d views = Somewhere(4);
    const Eigen::AlignedBox3d targets = Somewhere(4);
    if (EntirelyVisible(grid_, views, targets)) continue;
    ++not_visible;
    bool found = false;
    for (int ray = 0; ray < 3000 && !found; ++ray) found = !Clear(In(views), In(targets));
    nothing_found += !found;
  }
  EXPECT_LT(nothing_found, not_visible / 25);
}

}  // namespace
}  // namespace vantage::visibility
