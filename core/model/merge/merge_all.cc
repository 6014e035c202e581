#include "core/model/merge/merge_all.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/merge/brick_set.h"
#include "core/model/merge/merge_region.h"
#include "core/model/merge/publish_region.h"

namespace vantage::model {
namespace {

// Bricks along an edge of what is computed at a time: 13 m at voxels of 5 cm, about what one scan
// of a room touches, so that it takes no more memory than a merge does. What is read around it, two
// bricks on each side, is then two fifths more.
constexpr int kBlock = 32;

// What all layers say of bricks by themselves.
struct LayerSets {
  BrickSet certain;  // wholly empty, whatever is around them
  BrickSet open;     // those that have to be computed
  BrickSet known;    // of which any layer says anything
};

LayerSets SetsOf(std::span<const ScanLayer* const> layers) {
  LayerSets sets;
  BrickSet with_surface;
  for (const ScanLayer* layer : layers) {
    for (const auto& [key, brick] : layer->bricks.own()) {
      sets.known.Add(BrickOf(key));
      if (brick.surface.Any()) with_surface.Add(BrickOf(key));
    }
    for (const auto& [page, bricks] : layer->bricks.empty()) {
      sets.known.Add(page, bricks);
      sets.certain.Add(page, bricks);
    }
  }
  // What one saw wholly empty, and none saw surface in.
  sets.certain.Remove(with_surface);
  sets.open = sets.known.Grown();
  sets.open.Remove(sets.certain);
  return sets;
}

// In blocks, each with its bricks in ascending order.
std::map<BrickKey, std::vector<BrickKey>> BlocksOf(const BrickSet& bricks) {
  std::map<BrickKey, std::vector<BrickKey>> blocks;
  for (const BrickKey key : bricks.Keys()) {
    const VoxelIndex brick = BrickOf(key);
    const auto block = [](int at) { return at >= 0 ? at / kBlock : -((kBlock - 1 - at) / kBlock); };
    blocks[KeyOf({block(brick.x()), block(brick.y()), block(brick.z())})].push_back(key);
  }
  return blocks;
}

}  // namespace

MergeResult MergeAll(std::span<const ScanLayer* const> layers, double voxel_size,
                     const ModelLeaf& all_empty, parallel::Parallel& parallel,
                     ModelOctree& octree) {
  const LayerSets sets = SetsOf(layers);
  MergeResult result;
  result.recomputed = sets.open.size() + sets.certain.size();
  absl::flat_hash_map<BrickKey, ModelLeaf> before;  // of open bricks
  octree.ForEach([&](const VoxelIndex& brick, const ModelLeaf& leaf) {
    if (sets.open.Has(brick)) {
      before.emplace(KeyOf(brick), leaf);
    } else if (!sets.certain.Has(brick)) {
      result.changed.push_back({brick, nullptr});
    }
  });
  for (const BrickAt& forgotten : result.changed) octree.Set(forgotten.brick, nullptr);

  result.emptied.contents = all_empty;
  for (const auto& [page, bricks] : sets.certain.pages()) {
    const ModelOctree::PageContents contents = octree.In(BrickOf(page), all_empty);
    BrickMask emptied;
    BrickMask unknown;
    BrickMask other;
    for (size_t w = 0; w < emptied.word.size(); ++w) {
      emptied.word[w] = bricks.word[w] & ~contents.same.word[w];
      unknown.word[w] = bricks.word[w] & ~contents.known.word[w];
      other.word[w] = emptied.word[w] & contents.known.word[w];
    }
    if (!emptied.Any()) continue;
    result.emptied.by_page[page] = emptied;
    octree.SetUnknown(BrickOf(page), unknown, all_empty);
    const VoxelIndex first = BrickOf(page) * BrickPage::kSide;
    other.ForEach([&](int local) {
      octree.Set(first + VoxelIndex(local & 7, local >> 3 & 7, local >> 6), all_empty);
    });
  }

  // Until they are computed, the blocks beside see of open bricks only whether they are known: what
  // the octree had of them is out of date.
  const ModelLeaf pending = std::make_shared<const Brick>();
  for (const BrickKey key : sets.open.Keys()) {
    const VoxelIndex brick = BrickOf(key);
    octree.Set(brick, sets.known.Has(brick) ? pending : nullptr);
  }
  for (const auto& [block, keys] : BlocksOf(sets.open)) {
    MergeRegion region(keys, layers, octree, all_empty);
    std::vector<ModelLeaf> contents =
        PublishRegion(region, layers, voxel_size, all_empty, parallel);
    for (size_t i = 0; i < keys.size(); ++i) {
      const auto old = before.find(keys[i]);
      const bool same =
          old == before.end() ? contents[i] == nullptr : SameContents(contents[i], old->second);
      const VoxelIndex brick = BrickOf(keys[i]);
      octree.Set(brick, same && old != before.end() ? old->second : contents[i]);
      if (!same) result.changed.push_back({brick, std::move(contents[i])});
    }
  }
  std::sort(result.changed.begin(), result.changed.end(),
            [](const BrickAt& a, const BrickAt& b) { return KeyOf(a.brick) < KeyOf(b.brick); });
  return result;
}

}  // namespace vantage::model
