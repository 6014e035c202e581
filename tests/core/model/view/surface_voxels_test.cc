// Packed attributes, against those that were packed.
#include "core/model/view/surface_voxels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/model/view/planning_view.h"

namespace vantage::model {
namespace {

constexpr double kEdge = 0.05;  // m, of a voxel

// False surface as a merge makes it, with these of the 26 voxels around it empty.
SurfaceVoxel FalseVoxel(const VoxelIndex& voxel, uint32_t empty, std::mt19937_64& random) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int n = 0, bit = 0; n < 27; ++n) {
    if (n == 13) continue;
    if ((empty >> bit++ & 1) == 0) continue;
    const VoxelIndex towards(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    sum += towards.cast<float>();
  }
  if (sum.squaredNorm() < 0.5f) sum = Eigen::Vector3f(0, 0, -1);
  SurfaceVoxel surface;
  const Eigen::Vector3d centre = (voxel.cast<double>().array() + 0.5) * kEdge;
  surface.centroid = centre.cast<float>();
  surface.normal = sum.normalized();
  surface.area = static_cast<float>(kEdge * kEdge) / surface.normal.lpNorm<Eigen::Infinity>();
  surface.missed = static_cast<uint8_t>(random() % 3);
  surface.ambiguous = random() % 2 == 0;
  surface.given_up = surface.missed == 2;
  return surface;
}

SurfaceVoxel TrueVoxel(std::mt19937_64& random) {
  std::uniform_real_distribution<float> unit(-1, 1);
  SurfaceVoxel surface;
  surface.centroid = {unit(random), unit(random), unit(random)};
  surface.normal = Eigen::Vector3f(unit(random), unit(random), 1).normalized();
  surface.area = 0.002f;
  surface.density = 100 * unit(random);
  surface.samples = static_cast<uint32_t>(random() % 100);
  surface.spread = static_cast<uint8_t>(random());
  return surface;
}

void ExpectSame(const SurfaceVoxel& found, const SurfaceVoxel& expected) {
  EXPECT_EQ(found.centroid, expected.centroid);
  EXPECT_EQ(found.normal, expected.normal);
  EXPECT_EQ(found.area, expected.area);
  EXPECT_EQ(found.density, expected.density);
  EXPECT_EQ(found.samples, expected.samples);
  EXPECT_EQ(found.missed, expected.missed);
  EXPECT_EQ(found.spread, expected.spread);
  EXPECT_EQ(found.ambiguous, expected.ambiguous);
  EXPECT_EQ(found.given_up, expected.given_up);
}

TEST(SurfaceVoxelsTest, ComeBackToTheBit) {
  std::mt19937_64 random(1);
  for (const VoxelIndex& brick : {VoxelIndex(0, 0, 0), VoxelIndex(-17, 3, 250)}) {
    SurfaceVoxels packed(brick, kEdge);
    std::vector<SurfaceVoxel> expected;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (random() % 4 == 0) {
        expected.push_back(TrueVoxel(random));
        packed.push_back(expected.back());
        ExpectSame(packed.Stored(expected.size() - 1), expected.back());
      } else {
        const VoxelIndex voxel = PlanningView::Global(brick, local);
        expected.push_back(FalseVoxel(voxel, static_cast<uint32_t>(random()), random));
        packed.AddFalse(expected.back(), local);
      }
    }
    ASSERT_EQ(packed.size(), expected.size());
    size_t i = 0;
    for (const SurfaceVoxel& found : packed) ExpectSame(found, expected[i++]);
  }
}

// Whatever is empty around it, false surface takes four bytes.
TEST(SurfaceVoxelsTest, FalseSurfaceTakesFourBytes) {
  std::mt19937_64 random(2);
  SurfaceVoxels packed(VoxelIndex(3, -2, 1), kEdge);
  const int count = 100'000;
  for (int i = 0; i < count; ++i) {
    const int local = i % Brick::kVoxels;
    // Few of the 26 or many.
    uint32_t empty = static_cast<uint32_t>(random());
    if (i % 3 == 0) empty &= static_cast<uint32_t>(random() & random());
    if (i % 3 == 1) empty |= static_cast<uint32_t>(random() | random());
    const VoxelIndex voxel = PlanningView::Global(VoxelIndex(3, -2, 1), local);
    packed.AddFalse(FalseVoxel(voxel, empty, random), local);
  }
  packed.shrink_to_fit();
  EXPECT_EQ(packed.bytes(), 4u * count);
}

// What is no such voxel is kept as it is.
TEST(SurfaceVoxelsTest, AnythingElseIsStored) {
  std::mt19937_64 random(3);
  const VoxelIndex brick(1, 2, 3);
  const auto check = [&](auto&& change) {
    const VoxelIndex voxel = PlanningView::Global(brick, 77);
    SurfaceVoxel surface = FalseVoxel(voxel, 0b1011, random);
    change(surface);
    for (SurfaceVoxels packed : {SurfaceVoxels(brick, kEdge), SurfaceVoxels()}) {
      packed.AddFalse(surface, 77);
      ExpectSame(packed[0], surface);
      EXPECT_GT(packed.bytes(), sizeof(SurfaceVoxel));
    }
  };
  check([](SurfaceVoxel& s) { s.centroid.x() += 0.01f; });
  check([](SurfaceVoxel& s) { s.normal = Eigen::Vector3f(0.6f, 0.5f, 0.62f).normalized(); });
  check([](SurfaceVoxel& s) { s.normal.setZero(); });
  check([](SurfaceVoxel& s) { s.normal.setConstant(1e-40f); });
  check([](SurfaceVoxel& s) { s.area *= 1.001f; });
  check([](SurfaceVoxel& s) { s.density = 3; });
  check([](SurfaceVoxel& s) { s.samples = 1; });
  check([](SurfaceVoxel& s) { s.spread = 1; });
  check([](SurfaceVoxel& s) { s.missed = 200; });
  // Of a damaged file.
  SurfaceVoxel damaged = FalseVoxel(PlanningView::Global(brick, 77), 0b1011, random);
  damaged.normal.setConstant(NAN);
  SurfaceVoxels packed(brick, kEdge);
  packed.AddFalse(damaged, 77);
  EXPECT_TRUE(packed[0].normal.array().isNaN().all());
  EXPECT_GT(packed.bytes(), sizeof(SurfaceVoxel));
}

TEST(SurfaceVoxelsTest, AreEqualByWhatTheyHold) {
  std::mt19937_64 random(4);
  const VoxelIndex brick(1, 2, 3);
  const SurfaceVoxel of_false = FalseVoxel(PlanningView::Global(brick, 5), 0b110, random);
  const SurfaceVoxel of_true = TrueVoxel(random);
  SurfaceVoxels packed(brick, kEdge);
  packed.AddFalse(of_false, 5);
  packed.push_back(of_true);
  SurfaceVoxels stored;
  stored.push_back(of_false);
  EXPECT_FALSE(packed == stored);
  stored.push_back(of_true);
  EXPECT_TRUE(packed == stored);
  EXPECT_TRUE(stored == packed);
  SurfaceVoxels again = packed;
  EXPECT_TRUE(packed == again);
  again.clear();
  again.AddFalse(of_false, 5);
  SurfaceVoxel other = of_true;
  other.normal.x() = -other.normal.x();
  again.push_back(other);
  EXPECT_FALSE(packed == again);
}

}  // namespace
}  // namespace vantage::model
