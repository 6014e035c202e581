// Packed cells, against a list that holds them as they are.
#include "core/planning/patches/deficient_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace vantage::planning {
namespace {

constexpr double kCellEdge = 0.05;  // m

Eigen::Vector3f CentreOf(const model::VoxelIndex& voxel) {
  const Eigen::Vector3d centre = (voxel.cast<double>().array() + 0.5) * kCellEdge;
  return centre.cast<float>();
}

// False surface as the model has it: at the voxel's centre, of a few normals and densities.
DeficientCell FalseCell(const model::VoxelIndex& voxel, std::mt19937_64& random) {
  DeficientCell cell;
  cell.voxel = voxel;
  cell.kind = static_cast<model::SurfaceKind>(1 + random() % 3);
  cell.position = CentreOf(voxel);
  cell.normal = Eigen::Vector3f(static_cast<float>(random() % 3) - 1, 1, 0).normalized();
  cell.area = 0.0025f;
  cell.required = 2500;
  cell.enough = 2500.0f * static_cast<float>(1 + random() % 4);
  cell.success = random() % 2 == 0 ? 1.0f : 2.0f / 3;
  return cell;
}

DeficientCell TrueCell(const model::VoxelIndex& voxel, std::mt19937_64& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  DeficientCell cell;
  cell.voxel = voxel;
  // Outside its voxel, too: centroids are of all samples that it absorbed.
  cell.position = CentreOf(voxel) + 0.1f * Eigen::Vector3f(unit(random), unit(random), -0.4f);
  cell.normal = Eigen::Vector3f(unit(random), unit(random), 1).normalized();
  cell.area = unit(random);
  cell.density = 2000 * unit(random);
  cell.spread = 1 + static_cast<float>(random() % 256) / 256;
  cell.required = cell.enough = 2500;
  cell.worth = random() % 2 == 0 ? 1.0f : 0.3f;
  return cell;
}

// Bricks in turn, negative ones too, each with some of its voxels.
std::vector<DeficientCell> RandomCells(uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<DeficientCell> cells;
  uint32_t dropouts = 0;
  for (int brick = -20; brick < 20; ++brick) {
    for (int local = static_cast<int>(random() % 9); local < model::Brick::kVoxels; local += 9) {
      const model::VoxelIndex voxel =
          model::PlanningView::Global({brick, 3 - brick, brick / 3}, local);
      cells.push_back(random() % 3 == 0 ? TrueCell(voxel, random) : FalseCell(voxel, random));
      DeficientCell& cell = cells.back();
      cell.dropouts = dropouts;
      cell.dropout_count = random() % 10 == 0 ? 2 : 0;
      dropouts += cell.dropout_count;
      if (random() % 4 == 0) cell.skyline.sine.fill(static_cast<int8_t>(random() % 5));
    }
  }
  return cells;
}

DeficientCells Packed(const std::vector<DeficientCell>& cells) {
  DeficientCells::Builder builder(kCellEdge);
  for (const DeficientCell& cell : cells) builder.Add(cell);
  return std::move(builder).Build();
}

void ExpectSame(const DeficientCells& packed, size_t i, const DeficientCell& expected) {
  const DeficientCell found = packed[i];
  ASSERT_EQ(found.voxel, expected.voxel) << i;
  EXPECT_EQ(found.kind, expected.kind) << i;
  EXPECT_EQ(found.position, expected.position) << i;
  EXPECT_EQ(found.normal, expected.normal) << i;
  EXPECT_EQ(found.area, expected.area) << i;
  EXPECT_EQ(found.density, expected.density) << i;
  EXPECT_EQ(found.spread, expected.spread) << i;
  EXPECT_EQ(found.required, expected.required) << i;
  EXPECT_EQ(found.enough, expected.enough) << i;
  EXPECT_EQ(found.success, expected.success) << i;
  EXPECT_EQ(found.worth, expected.worth) << i;
  EXPECT_EQ(found.skyline.sine, expected.skyline.sine) << i;
  EXPECT_EQ(found.dropout_count, expected.dropout_count) << i;
  if (expected.dropout_count > 0) {
    EXPECT_EQ(found.dropouts, expected.dropouts) << i;
  }
  EXPECT_EQ(found.expected, expected.expected) << i;
  EXPECT_EQ(packed.Voxel(i), expected.voxel) << i;
  EXPECT_EQ(packed.Kind(i), expected.kind) << i;
  EXPECT_EQ(packed.Position(i), expected.position) << i;
  EXPECT_EQ(packed.Normal(i), expected.normal) << i;
  EXPECT_EQ(packed.Area(i), expected.area) << i;
  EXPECT_EQ(packed.Expected(i), expected.expected) << i;
}

TEST(DeficientCellsTest, ComeBackToTheBit) {
  const std::vector<DeficientCell> cells = RandomCells(1);
  const DeficientCells packed = Packed(cells);
  ASSERT_EQ(packed.size(), cells.size());
  size_t i = 0;
  for (const DeficientCell& cell : packed) {
    EXPECT_EQ(cell.position, cells[i].position);
    ExpectSame(packed, i, cells[i]);
    ++i;
  }
  EXPECT_EQ(i, cells.size());
}

TEST(DeficientCellsTest, KeepAllTheyHaveInAnotherOrder) {
  const std::vector<DeficientCell> cells = RandomCells(2);
  DeficientCells packed = Packed(cells);
  std::vector<uint32_t> order(cells.size());
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937_64 random(3);
  std::shuffle(order.begin(), order.end(), random);
  std::vector<uint32_t> used = order;
  packed.Reorder(used);
  for (size_t i = 0; i < order.size(); ++i) ExpectSame(packed, i, cells[order[i]]);
}

TEST(DeficientCellsTest, ExpectedOnesAreMarked) {
  std::vector<DeficientCell> cells = RandomCells(4);
  DeficientCells packed = Packed(cells);
  for (size_t i = 0; i < cells.size(); i += 3) {
    packed.SetExpected(i);
    cells[i].expected = true;
  }
  for (size_t i = 0; i < cells.size(); ++i) ExpectSame(packed, i, cells[i]);
}

TEST(DeficientCellsTest, FalseSurfaceTakesTwelveBytes) {
  std::mt19937_64 random(5);
  DeficientCells::Builder of_false(kCellEdge);
  DeficientCells::Builder of_true(kCellEdge);
  size_t count = 0;
  for (int brick = 0; brick < 1000; ++brick) {
    for (int local = 0; local < model::Brick::kVoxels; local += 6) {
      const model::VoxelIndex voxel = model::PlanningView::Global({brick, 0, 0}, local);
      of_false.Add(FalseCell(voxel, random));
      of_true.Add(TrueCell(voxel, random));
      ++count;
    }
  }
  // 86 cells of a brick share its coordinates.
  EXPECT_LE(std::move(of_false).Build().bytes(), count * 12 + 20'000);
  EXPECT_LE(std::move(of_true).Build().bytes(), count * 48 + 120'000);
}

}  // namespace
}  // namespace vantage::planning
