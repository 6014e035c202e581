// Sets of bricks against plain sets of coordinates.
#include "core/model/merge/brick_set.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace vantage::model {
namespace {

std::set<BrickKey> Plain(const BrickSet& set) {
  const std::vector<BrickKey> keys = set.Keys();
  EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
  EXPECT_EQ(keys.size(), set.size());
  return {keys.begin(), keys.end()};
}

// In clumps, across the borders of pages and the origin.
BrickSet Random(std::mt19937_64& random, std::set<BrickKey>& plain) {
  BrickSet set;
  const auto add = [&](const VoxelIndex& brick) {
    set.Add(brick);
    plain.insert(KeyOf(brick));
  };
  for (int clump = 0; clump < 6; ++clump) {
    VoxelIndex first;
    VoxelIndex size;
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<int>(random() % 30) - 15;
      size[a] = 1 + static_cast<int>(random() % 9);
    }
    for (int z = 0; z < size.z(); ++z) {
      for (int y = 0; y < size.y(); ++y) {
        for (int x = 0; x < size.x(); ++x) {
          if (random() % 4 != 0) add(first + VoxelIndex(x, y, z));
        }
      }
    }
  }
  return set;
}

TEST(BrickSetTest, GrowsByAllThatIsBeside) {
  std::mt19937_64 random(1);
  for (int run = 0; run < 10; ++run) {
    std::set<BrickKey> plain;
    const BrickSet set = Random(random, plain);
    EXPECT_EQ(Plain(set), plain);
    std::set<BrickKey> grown;
    for (const BrickKey key : plain) {
      for (int i = 0; i < 27; ++i) {
        grown.insert(KeyOf(BrickOf(key) + VoxelIndex(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      }
    }
    EXPECT_EQ(Plain(set.Grown()), grown);
  }
}

TEST(BrickSetTest, EdgesAreWhereTheNeighbourIsMissing) {
  std::mt19937_64 random(2);
  std::set<BrickKey> plain;
  const BrickSet set = Random(random, plain);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int direction : {-1, 1}) {
      std::set<BrickKey> expected;
      for (const BrickKey key : plain) {
        VoxelIndex beside = BrickOf(key);
        beside[axis] += direction;
        EXPECT_EQ(set.Has(beside), plain.contains(KeyOf(beside)));
        if (!plain.contains(KeyOf(beside))) expected.insert(key);
      }
      BrickSet edge;
      for (const auto& [page, bricks] : set.pages()) {
        edge.Add(page, set.EdgeIn(page, axis, direction));
      }
      EXPECT_EQ(Plain(edge), expected);
    }
  }
}

TEST(BrickSetTest, WhatIsRemovedIsGone) {
  std::mt19937_64 random(3);
  std::set<BrickKey> plain;
  std::set<BrickKey> others;
  BrickSet set = Random(random, plain);
  const BrickSet removed = Random(random, others);
  set.Remove(removed);
  for (const BrickKey key : others) plain.erase(key);
  EXPECT_EQ(Plain(set), plain);
  for (const auto& [page, bricks] : set.pages()) EXPECT_TRUE(bricks.Any());
  BrickSet all = set;
  all.Remove(set);
  EXPECT_TRUE(all.pages().empty());
}

}  // namespace
}  // namespace vantage::model
