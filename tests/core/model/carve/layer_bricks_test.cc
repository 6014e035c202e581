// The bricks of a layer against a plain map.
#include "core/model/carve/layer_bricks.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace vantage::model {
namespace {

LayerBrick RandomContents(std::mt19937_64& random) {
  LayerBrick brick;
  switch (random() % 3) {
    case 0:
      brick.empty.word.fill(~uint64_t{0});
      break;
    case 1:
      brick.empty.word.fill(random());
      break;
    default:
      brick.surface.Set(static_cast<int>(random() % Brick::kVoxels));
      SurfaceSums sums;
      sums.points = 1 + static_cast<uint32_t>(random() % 9);
      brick.sums.push_back(sums);
  }
  return brick;
}

void ExpectSame(const LayerBrick* found, const LayerBrick& expected) {
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->empty, expected.empty);
  EXPECT_EQ(found->surface, expected.surface);
  ASSERT_EQ(found->sums.size(), expected.sums.size());
  for (size_t i = 0; i < expected.sums.size(); ++i) {
    EXPECT_EQ(found->sums[i].points, expected.sums[i].points);
  }
}

TEST(LayerBricksTest, SaysWhatAMapWould) {
  std::mt19937_64 random(4);
  LayerBricks bricks;
  std::map<BrickKey, LayerBrick> plain;
  const auto somewhere = [&] {
    return KeyOf({static_cast<int>(random() % 24) - 12, static_cast<int>(random() % 12) - 6,
                  static_cast<int>(random() % 4)});
  };
  for (int step = 0; step < 4000; ++step) {
    const BrickKey key = somewhere();
    switch (random() % 5) {
      case 0: {
        const LayerBrick taken = bricks.Take(key);
        ExpectSame(&taken, plain.contains(key) ? plain[key] : LayerBrick());
        plain.erase(key);
        break;
      }
      case 1: {
        const int local = static_cast<int>(random() % Brick::kVoxels);
        bricks[key].empty.Set(local);
        plain[key].empty.Set(local);
        break;
      }
      default: {
        const LayerBrick contents = RandomContents(random);
        bricks.Put(key, contents);
        plain[key] = contents;
      }
    }
    if (step % 100 != 0) continue;
    ASSERT_EQ(bricks.size(), plain.size());
    for (const auto& [there, contents] : plain) ExpectSame(bricks.Find(there), contents);
    std::map<BrickKey, LayerBrick> met;
    bricks.ForEach([&](BrickKey there, const LayerBrick& contents) {
      EXPECT_TRUE(met.emplace(there, contents).second) << "twice";
    });
    ASSERT_EQ(met.size(), plain.size());
    for (const auto& [there, contents] : met) ExpectSame(&contents, plain.at(there));
    const BrickKey other = somewhere();
    EXPECT_EQ(bricks.Find(other) != nullptr, plain.contains(other));
  }
  EXPECT_FALSE(bricks.empty().empty());
  bricks.clear();
  EXPECT_EQ(bricks.size(), 0u);
}

// A hall's worth of empty space takes a bit a brick.
TEST(LayerBricksTest, EmptyPagesAreBits) {
  LayerBricks bricks;
  BrickMask all;
  all.word.fill(~uint64_t{0});
  bricks.PutEmpty({3, -2, 1}, all);
  EXPECT_EQ(bricks.size(), 512u);
  EXPECT_TRUE(bricks.own().empty());
  const BrickKey inside = KeyOf({3 * 8 + 5, -2 * 8 + 1, 8});
  ASSERT_NE(bricks.Find(inside), nullptr);
  EXPECT_TRUE(bricks.Find(inside)->WhollyEmpty());
  EXPECT_EQ(bricks.Find(KeyOf({3 * 8 + 8, -2 * 8 + 1, 8})), nullptr);
  bricks[inside].empty.Clear(7);
  EXPECT_EQ(bricks.size(), 512u);
  EXPECT_FALSE(bricks.Find(inside)->WhollyEmpty());
  EXPECT_EQ(bricks.Find(inside)->empty.Count(), Brick::kVoxels - 1);
}

}  // namespace
}  // namespace vantage::model
