// A merge recomputes all that a layer can have an influence on, however far that reaches.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <span>

#include "core/model/carve/carve.h"
#include "core/model/merge/merge.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::model {
namespace {

constexpr double kVoxel = 0.05;
// Far enough from the origin that all of it lies on one side of the scanner.
constexpr int kFrom = -64;  // voxels, on every axis

// Places in voxels along the axis that is tried, and two others.
class Clusters {
 public:
  Clusters(int axis, bool upwards) : axis_(axis), upwards_(upwards) {}

  // As many points as asked for, in eights, at the corners of a box around `centre`.
  void AddBox(const Eigen::Vector3d& centre, const Eigen::Vector3d& half, int eights,
              ScanLayer& layer) const {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const Eigen::Vector3d at = centre + side.cwiseProduct(half);
      for (int i = 0; i < eights; ++i) Add(at, layer);
    }
  }

  // Points spread over a piece of a plane.
  void AddPlane(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal, int rows,
                ScanLayer& layer) const {
    const Eigen::Vector3d across = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d along = normal.normalized().cross(across);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < 5; ++column) {
        const double u = 0.4 * row / (rows - 1) - 0.2;
        const double v = 0.4 * column / 4 - 0.2;
        Add(centre + u * along + v * across, layer);
      }
    }
  }

 private:
  void Add(const Eigen::Vector3d& at, ScanLayer& layer) const {
    Eigen::Vector3d place;
    place[axis_] = upwards_ ? at.x() : -at.x();
    place[(axis_ + 1) % 3] = at.y();
    place[(axis_ + 2) % 3] = at.z();
    const Eigen::Vector3d floor = place.array().floor();
    std::array<uint32_t, 3> offset;
    for (size_t i = 0; i < 3; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      offset[i] = static_cast<uint32_t>((place[k] - floor[k]) * SurfaceSums::kUnits);
    }
    const VoxelIndex voxel = floor.cast<int>() + VoxelIndex::Constant(kFrom);
    LayerBrick& brick = layer.bricks[KeyOf(Brick::Of(voxel))];
    const int local = Brick::LocalOf(voxel);
    const auto rank = brick.surface.Rank(local);
    std::vector<SurfaceSums> sums = brick.sums.Unpacked();
    if (!brick.surface.Has(local)) {
      brick.surface.Set(local);
      sums.insert(sums.begin() + rank, SurfaceSums());
    }
    sums[static_cast<size_t>(rank)].Add(offset, true);
    brick.sums = PackedSums(sums);
  }

  int axis_;
  bool upwards_;
};

std::map<BrickKey, Brick> Everything(const ModelOctree& octree) {
  std::map<BrickKey, Brick> all;
  octree.ForEach(
      [&](const VoxelIndex& brick, const ModelLeaf& leaf) { all[KeyOf(brick)] = *leaf; });
  return all;
}

void ExpectSame(const std::map<BrickKey, Brick>& a, const std::map<BrickKey, Brick>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (const auto& [key, brick] : a) {
    const auto it = b.find(key);
    ASSERT_TRUE(it != b.end());
    EXPECT_EQ(brick.state, it->second.state) << BrickOf(key).transpose();
    ASSERT_EQ(brick.surface.size(), it->second.surface.size());
    for (size_t i = 0; i < brick.surface.size(); ++i) {
      EXPECT_EQ(brick.surface[i].centroid, it->second.surface[i].centroid);
      EXPECT_EQ(brick.surface[i].normal, it->second.surface[i].normal);
      EXPECT_EQ(brick.surface[i].samples, it->second.surface[i].samples);
    }
  }
}

size_t MostSamples(const std::map<BrickKey, Brick>& bricks) {
  uint32_t most = 0;
  for (const auto& [key, brick] : bricks) {
    for (const SurfaceVoxel& surface : brick.surface) most = std::max(most, surface.samples);
  }
  return most;
}

// Points at -1 decide whether the voxel at 0 is flat, that whether the one at 2 takes its plane,
// that whether it dominates the one at 4, and that which of 4 and 8 absorbs the one at 6.
TEST(MergeReachTest, AVoxelNineAwayIsRecomputed) {
  parallel::Serial serial;
  const sensor::Scan scan =
      ScanScene(EmptyRoom(), PoseAt({0.4, 0.3, 1.5}), {.step = sensor::Radians(10)});
  const ModelLeaf all_empty = MakeAllEmpty();
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool upwards : {true, false}) {
      SCOPED_TRACE(testing::Message() << "axis " << axis << (upwards ? " up" : " down"));
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation().fill(kVoxel * (kFrom + 4.5));
      pose.translation()[axis] += upwards ? 3.0 : -3.0;
      const auto layer_of = [&] {
        auto layer = Carve(scan, pose, {.voxel_size = kVoxel}, serial);
        layer->bricks.clear();
        return layer;
      };
      const Clusters clusters(axis, upwards);
      const auto near = layer_of();
      clusters.AddBox({-0.5, 6.5, 4.5}, {0.4, 0.4, 0.4}, 4, *near);
      const auto far = layer_of();
      clusters.AddPlane({0.8, 6.4, 4.5}, {0.8, 0.6, 0}, 6, *far);
      clusters.AddBox({2.3, 4.4, 4.5}, {0.28, 0.2, 0.4}, 5, *far);
      clusters.AddPlane({4.7, 4.5, 4.5}, {0.95, 0.3122, 0}, 6, *far);
      clusters.AddPlane({6.3, 4.5, 4.5}, {1, 0, 0}, 4, *far);
      clusters.AddPlane({8.5, 4.5, 4.5}, {1, 0, 0}, 10, *far);

      const std::array<const ScanLayer*, 2> both = {near.get(), far.get()};
      const std::array<const ScanLayer*, 1> only_far = {far.get()};
      const std::array<const ScanLayer*, 1> only_near = {near.get()};
      const auto merge = [&](const ScanLayer& layer, LayerChange change,
                             std::span<const ScanLayer* const> layers, ModelOctree& octree) {
        (void)MergeAround(layer, change, {}, layers, kVoxel, all_empty, serial, octree);
      };
      ModelOctree octree(kVoxel);
      merge(*far, LayerChange::kAdded, only_far, octree);
      const auto before = Everything(octree);
      EXPECT_EQ(MostSamples(before), 70u) << "6 was to be absorbed by 8";
      merge(*near, LayerChange::kAdded, both, octree);
      const auto with = Everything(octree);
      ModelOctree other(kVoxel);
      merge(*near, LayerChange::kAdded, only_near, other);
      merge(*far, LayerChange::kAdded, both, other);
      EXPECT_EQ(MostSamples(Everything(other)), 50u) << "6 was to be absorbed by 4";
      ExpectSame(with, Everything(other));
      merge(*near, LayerChange::kRemoved, only_far, octree);
      ExpectSame(Everything(octree), before);
    }
  }
}

}  // namespace
}  // namespace vantage::model
