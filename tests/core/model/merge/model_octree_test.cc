// Setting and asking by page against brick by brick.
#include "core/model/merge/model_octree.h"

#include <gtest/gtest.h>

#include <random>

#include "core/model/merge/merge.h"
#include "core/model/view/brick_pages.h"

namespace vantage::model {
namespace {

TEST(ModelOctreeTest, PagesAreAllTheirBricks) {
  const ModelLeaf all_empty = MakeAllEmpty();
  const auto other = std::make_shared<const Brick>();
  std::mt19937_64 random(6);
  ModelOctree by_page(0.05);
  ModelOctree by_brick(0.05);
  // Some bricks, then what is unknown of pages beside and over them; some of it all of a page, and
  // eight pages that become one node.
  for (int i = 0; i < 200; ++i) {
    const VoxelIndex brick(static_cast<int>(random() % 40) - 20,
                           static_cast<int>(random() % 40) - 20,
                           static_cast<int>(random() % 10) - 5);
    const ModelLeaf leaf = random() % 4 == 0 ? nullptr : random() % 2 == 0 ? all_empty : other;
    by_page.Set(brick, leaf);
    by_brick.Set(brick, leaf);
  }
  for (int i = 0; i < 64; ++i) {
    const VoxelIndex page(i % 4 - 2, i / 4 % 4 - 2, i / 16 - 1);
    const ModelOctree::PageContents before = by_page.In(page, all_empty);
    BrickMask unknown;
    for (uint64_t& word : unknown.word) word = random() % 3 == 0 ? random() : ~uint64_t{0};
    for (size_t w = 0; w < unknown.word.size(); ++w) unknown.word[w] &= ~before.known.word[w];
    by_page.SetUnknown(page, unknown, all_empty);
    unknown.ForEach([&](int local) {
      by_brick.Set(page * 8 + VoxelIndex(local & 7, local >> 3 & 7, local >> 6), all_empty);
    });
  }
  EXPECT_EQ(by_page.size(), by_brick.size()) << "nodes";
  size_t known = 0;
  for (int i = 0; i < 1000; ++i) {
    const VoxelIndex page(i % 10 - 5, i / 10 % 10 - 5, i / 100 - 5);
    const ModelOctree::PageContents contents = by_page.In(page, all_empty);
    for (int local = 0; local < Brick::kVoxels; ++local) {
      const VoxelIndex brick = page * 8 + VoxelIndex(local & 7, local >> 3 & 7, local >> 6);
      const ModelLeaf leaf = by_brick.Find(brick);
      ASSERT_EQ(by_page.Find(brick), leaf) << brick.transpose();
      ASSERT_EQ(contents.known.Has(local), leaf != nullptr) << brick.transpose();
      ASSERT_EQ(contents.same.Has(local), leaf == all_empty) << brick.transpose();
      known += leaf != nullptr ? 1 : 0;
    }
  }
  EXPECT_GT(known, 10'000u);
}

// All of a page that nothing is known of becomes one node.
TEST(ModelOctreeTest, AnEmptyPageIsOneNode) {
  const ModelLeaf all_empty = MakeAllEmpty();
  BrickMask all;
  all.word.fill(~uint64_t{0});
  ModelOctree octree(0.05);
  octree.SetUnknown({1, 2, 3}, all, all_empty);
  EXPECT_EQ(octree.getNumLeafNodes(), 1u);
  for (int i = 0; i < 8; ++i) {
    const VoxelIndex page(4 + (i & 1), 4 + (i >> 1 & 1), 4 + (i >> 2));
    octree.SetUnknown(page, all, all_empty);
  }
  EXPECT_EQ(octree.getNumLeafNodes(), 2u);
}

}  // namespace
}  // namespace vantage::model
