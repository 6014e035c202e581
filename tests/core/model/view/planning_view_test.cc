// Versions of a planning view: their content, and the memory that each shares with the one before.
#include "core/model/view/planning_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>
#include <string>

#include "tests/support/runs.h"

namespace vantage::model {
namespace {

using Key = std::array<int, 3>;  // z, y, x: sorts as views do
using Bricks = std::map<Key, std::shared_ptr<const Brick>>;

VoxelIndex At(const Key& key) { return {key[2], key[1], key[0]}; }
Key PageOf(const Key& key) { return {key[0] >> 3, key[1] >> 3, key[2] >> 3}; }

std::shared_ptr<const Brick> RandomBrick(std::mt19937_64& random) {
  auto brick = std::make_shared<Brick>();
  for (int local = 0; local < Brick::kVoxels; ++local) {
    const auto state = static_cast<VoxelState>(random() % kVoxelStates);
    brick->state[static_cast<size_t>(local)] = state;
    if (!HasArea(state)) continue;
    brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
    SurfaceVoxel surface{};
    surface.centroid = surface.normal = Eigen::Vector3f::UnitZ();
    surface.samples = static_cast<uint32_t>(random());
    brick->surface.push_back(surface);
  }
  return brick;
}

// A cube of bricks from `corner` on, some of which are not there.
Bricks RandomBricks(const VoxelIndex& corner, const VoxelIndex& size, std::mt19937_64& random) {
  std::vector<std::shared_ptr<const Brick>> kinds(5);
  for (auto& kind : kinds) kind = RandomBrick(random);
  Bricks bricks;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        if (random() % 3 == 0) continue;
        bricks[{corner.z() + z, corner.y() + y, corner.x() + x}] = kinds[random() % kinds.size()];
      }
    }
  }
  return bricks;
}

std::vector<BrickAt> ListOf(const Bricks& bricks) {
  std::vector<BrickAt> list;
  list.reserve(bricks.size());
  for (const auto& [key, brick] : bricks) list.push_back({At(key), brick});
  return list;
}

std::set<Key> PagesOf(const Bricks& bricks) {
  std::set<Key> pages;
  for (const auto& [key, brick] : bricks) pages.insert(PageOf(key));
  return pages;
}

// Every way of reading the view against a plain map.
void ExpectSays(const PlanningView& view, const Bricks& bricks, std::mt19937_64& random) {
  ASSERT_EQ(view.bricks().size(), bricks.size());
  EXPECT_EQ(view.bricks().empty(), bricks.empty());
  auto expected = bricks.begin();
  for (const BrickAt& at : view.bricks()) {
    ASSERT_EQ(at.brick, At(expected->first));
    ASSERT_EQ(at.contents, expected->second);
    ++expected;
  }
  EXPECT_TRUE(expected == bricks.end());
  EXPECT_EQ(view.pages(), PagesOf(bricks).size());
  if (bricks.empty()) {
    EXPECT_TRUE(view.bounds().empty());
    EXPECT_EQ(view.State({1, 2, 3}), VoxelState::kUnknown);
    return;
  }
  VoxelIndex first = At(bricks.begin()->first);
  VoxelIndex last = first;
  size_t surfaces = 0;
  for (const auto& [key, brick] : bricks) {
    first = first.cwiseMin(At(key));
    last = last.cwiseMax(At(key));
    surfaces += brick->surface.size();
  }
  EXPECT_EQ(view.bounds().min, VoxelIndex(first * 8));
  EXPECT_EQ(view.bounds().max, VoxelIndex((last + VoxelIndex::Ones()) * 8));
  EXPECT_EQ(view.SurfaceCount(), surfaces);
  for (int i = 0; i < 10; ++i) {
    const size_t which = random() % bricks.size();
    const auto& [key, brick] = *std::next(bricks.begin(), static_cast<std::ptrdiff_t>(which));
    EXPECT_EQ(view.bricks()[which].brick, At(key));
    EXPECT_EQ(view.bricks()[which].contents, brick);
    EXPECT_EQ(view.State(At(key) * 8 + VoxelIndex(1, 2, 3)), brick->state[Brick::Local(1, 2, 3)]);
  }
  // Inside, beside and outside.
  const VoxelIndex span = (last - first + VoxelIndex::Constant(7)) * 8;
  for (int i = 0; i < 1000; ++i) {
    VoxelIndex v;
    for (int axis = 0; axis < 3; ++axis) {
      v[axis] =
          (first[axis] - 3) * 8 + static_cast<int>(random() % static_cast<uint64_t>(span[axis]));
    }
    const auto it = bricks.find({v.z() >> 3, v.y() >> 3, v.x() >> 3});
    const int local = Brick::LocalOf(v);
    const VoxelState state =
        it == bricks.end() ? VoxelState::kUnknown : it->second->state[static_cast<size_t>(local)];
    ASSERT_EQ(view.State(v), state) << v.transpose();
    const std::optional<SurfaceVoxel> found = view.Surface(v);
    const std::optional<SurfaceVoxel> same =
        it == bricks.end() ? std::nullopt : it->second->Surface(local);
    ASSERT_EQ(found.has_value(), same.has_value()) << v.transpose();
    if (same.has_value()) {
      EXPECT_EQ(found->samples, same->samples) << v.transpose();
    }
  }
}

TEST(PlanningViewTest, NothingKnown) {
  std::mt19937_64 random(1);
  const PlanningView view(0.05, 3, {}, {});
  ExpectSays(view, {}, random);
  EXPECT_EQ(view.version(), 3u);
}

TEST(PlanningViewTest, SaysWhatItWasGivenInAnyOrder) {
  for (uint64_t seed = 1; seed <= test_support::Runs(3u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    const Bricks bricks = RandomBricks({-13, -9, -3}, {30, 21, 12}, random);
    std::vector<BrickAt> list = ListOf(bricks);
    std::shuffle(list.begin(), list.end(), random);
    ExpectSays(PlanningView(0.05, seed, std::move(list), {}), bricks, random);
  }
}

// Two clusters far apart: the space between them must cost nothing.
TEST(PlanningViewTest, FarApart) {
  std::mt19937_64 random(5);
  Bricks bricks = RandomBricks({-700, -650, -90}, {9, 5, 4}, random);
  bricks.merge(RandomBricks({680, 500, 70}, {4, 9, 9}, random));
  ExpectSays(PlanningView(0.05, 1, ListOf(bricks), {}), bricks, random);
  bricks.merge(RandomBricks({-30000, 29000, 31000}, {4, 9, 9}, random));
  bricks.merge(RandomBricks({31000, -32000, -29000}, {9, 4, 9}, random));
  ExpectSays(PlanningView(0.05, 1, ListOf(bricks), {}), bricks, random);
}

// Versions one after the other: each says what it should, copies the pages that it changes and no
// others, and leaves those before it alone.
TEST(PlanningViewTest, AVersionCopiesOnlyThePagesThatChange) {
  for (uint64_t seed = 1; seed <= test_support::Runs(2u); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937_64 random(seed);
    Bricks bricks = RandomBricks({-40, -40, -8}, {80, 80, 16}, random);
    auto view =
        std::make_shared<const PlanningView>(0.05, 0, ListOf(bricks), std::vector<Station>());
    ASSERT_GE(view->pages(), 150u);
    std::vector<std::pair<std::shared_ptr<const PlanningView>, Bricks>> versions;
    for (uint64_t version = 1; version <= 4; ++version) {
      versions.emplace_back(view, bricks);
      // New bricks, others instead of those there, and none where some were; at times all of a
      // page.
      const VoxelIndex corner(static_cast<int>(random() % 90) - 48,
                              static_cast<int>(random() % 90) - 48,
                              static_cast<int>(random() % 20) - 10);
      const VoxelIndex size = version == 3 ? VoxelIndex(20, 20, 20) : VoxelIndex(7, 6, 5);
      Bricks changes = RandomBricks(corner, size, random);
      for (auto& [key, brick] : changes) {
        if (version == 3 || random() % 4 == 0) brick = nullptr;
      }
      if (version == 3) {
        for (const auto& [key, brick] : bricks) {
          const VoxelIndex in = At(key) - corner;
          if ((in.array() >= 0).all() && (in.array() < size.array()).all()) changes[key] = nullptr;
        }
      }
      for (const auto& [key, brick] : changes) {
        if (brick == nullptr) {
          bricks.erase(key);
        } else {
          bricks[key] = brick;
        }
      }
      view = std::make_shared<const PlanningView>(*view, version, ListOf(changes),
                                                  std::vector<Station>(version));
      EXPECT_EQ(view->version(), version);
      EXPECT_EQ(view->stations().size(), version);
      EXPECT_EQ(view->copied_pages(), PagesOf(changes).size());
      EXPECT_LT(view->copied_pages(), view->pages() / 4);
      ExpectSays(*view, bricks, random);
    }
    for (const auto& [before, said] : versions) ExpectSays(*before, said, random);
    // Down to nothing.
    for (auto& [key, brick] : bricks) brick = nullptr;
    ExpectSays(PlanningView(*view, 7, ListOf(bricks), {}), {}, random);
  }
}

// What is shared is the same memory.
TEST(PlanningViewTest, SharedPagesAreNotCopied) {
  std::mt19937_64 random(9);
  const Bricks bricks = RandomBricks({0, 0, 0}, {32, 32, 8}, random);
  const PlanningView before(0.05, 0, ListOf(bricks), {});
  const std::vector<BrickAt> change = {{{9, 10, 3}, RandomBrick(random)}};
  const PlanningView after(before, 1, change, {});
  EXPECT_EQ(after.copied_pages(), 1u);
  ASSERT_EQ(before.page_list().size(), 16u);
  ASSERT_EQ(after.page_list().size(), 16u);
  for (size_t i = 0; i < 16; ++i) {
    const bool changed = before.page_list()[i]->coordinates() == VoxelIndex(1, 1, 0);
    EXPECT_EQ(before.page_list()[i] == after.page_list()[i], !changed);
  }
}

// Bricks that are wholly empty are one, whichever they were given as.
TEST(PlanningViewTest, EmptyBricksAreOneOfAPage) {
  std::vector<BrickAt> list;
  for (int i = 0; i < Brick::kVoxels; ++i) {
    auto empty = std::make_shared<Brick>();
    empty->state.fill(VoxelState::kEmpty);
    list.push_back({{i & 7, i >> 3 & 7, i >> 6}, std::move(empty)});
  }
  const PlanningView view(0.05, 1, list, {});
  ASSERT_EQ(view.pages(), 1u);
  const BrickPage& page = *view.page_list()[0];
  EXPECT_TRUE(page.all_empty());
  EXPECT_EQ(view.bricks().size(), list.size());
  std::set<const Brick*> contents;
  for (const BrickAt& at : view.bricks()) contents.insert(at.contents.get());
  EXPECT_EQ(contents.size(), 1u);
  // Those given are let go, but for one.
  size_t kept = 0;
  for (const BrickAt& at : list) kept += at.contents.use_count() > 1 ? 1 : 0;
  EXPECT_EQ(kept, 1u);
  EXPECT_EQ(view.State({63, 63, 63}), VoxelState::kEmpty);
}

}  // namespace
}  // namespace vantage::model
