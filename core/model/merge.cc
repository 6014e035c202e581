#include "core/model/merge.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/fuse.h"
#include "core/model/local_plane.h"
#include "core/model/merge_region.h"
#include "core/model/publish_brick.h"
#include "core/model/unite.h"

namespace vantage {

namespace {

template <typename Fn>
void ForEachAround(const VoxelIndex& brick, Fn&& fn) {
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) fn(VoxelIndex(brick + VoxelIndex(x, y, z)));
    }
  }
}

bool AllEmpty(const BrickMask& mask) {
  return std::all_of(mask.word.begin(), mask.word.end(),
                     [](uint64_t word) { return word == ~uint64_t{0}; });
}

bool SameBits(const Brick& a, const Brick& b) {
  if (a.state != b.state || a.surface.size() != b.surface.size()) return false;
  if (a.surface.empty()) return true;
  // There are no gaps between its members, so their bytes say all; and -0 is not 0 here.
  static_assert(sizeof(SurfaceVoxel) == 2 * sizeof(Eigen::Vector3f) + 2 * sizeof(float) + 8);
  return std::memcmp(reinterpret_cast<const char*>(a.surface.data()),
                     reinterpret_cast<const char*>(b.surface.data()),
                     a.surface.size() * sizeof(SurfaceVoxel)) == 0;
}

// The bricks that the layer can have an influence on, ascending.
std::vector<BrickKey> Influenced(const ScanLayer& touched, LayerChange change,
                                 std::span<const BrickKey> also, const ModelOctree& octree,
                                 const ModelLeaf& all_empty) {
  absl::flat_hash_map<BrickKey, bool> known;
  const auto stays_empty = [&](const VoxelIndex& b) {
    const auto [it, fresh] = known.try_emplace(KeyOf(b), false);
    if (fresh) {
      const LayerBrick* own = touched.Find(b);
      it->second = (own == nullptr || AllEmpty(own->empty)) && octree.Find(b) == all_empty;
    }
    return it->second;
  };
  std::vector<BrickKey> keys;
  for (const BrickKey key : also) {
    ForEachAround(BrickOf(key), [&](const VoxelIndex& b) { keys.push_back(KeyOf(b)); });
  }
  for (const auto& [key, own] : touched.bricks) {
    const VoxelIndex brick = BrickOf(key);
    // Deep inside known-empty space nothing can change, nor touch anything that can.
    if (change == LayerChange::kAdded && stays_empty(brick)) {
      bool deep = true;
      ForEachAround(brick, [&](const VoxelIndex& b) { deep = deep && stays_empty(b); });
      if (deep) continue;
    }
    ForEachAround(brick, [&](const VoxelIndex& b) { keys.push_back(KeyOf(b)); });
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

}  // namespace

ModelLeaf MakeAllEmpty() {
  auto contents = std::make_shared<Brick>();
  contents->state.fill(VoxelState::kEmpty);
  return contents;
}

MergeResult MergeAround(const ScanLayer& touched, LayerChange change,
                        std::span<const BrickKey> also, std::span<const ScanLayer* const> layers,
                        double voxel_size, const ModelLeaf& all_empty, Parallel& parallel,
                        ModelOctree& octree) {
  const std::vector<BrickKey> keys = Influenced(touched, change, also, octree, all_empty);
  MergeRegion region(keys, layers, octree, all_empty);
  const size_t recomputed = region.recomputed();

  // Each stage reads what the one before wrote, in the bricks around too, so each is a loop of its
  // own.
  parallel.For(region.with_points(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.united == nullptr) {
      brick.united = Unite(region.brick(i), region.InLayers(i), layers);
    }
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.united == nullptr || brick.united->sums.empty()) return;
    brick.fitted =
        FitPlanes(region.brick(i), region.UnitedAround(i), region.InLayers(i), layers, voxel_size);
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    if (region.merged(i).fitted.empty()) return;
    region.merged(i).plane = SnapToFlatNeighbours(region.Around(i), voxel_size);
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.plane.empty()) return;
    std::vector<LocalPlane>().swap(brick.fitted);  // has served
    brick.dominated = FindDominated(region.brick(i), region.Around(i), voxel_size);
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.plane.empty()) return;
    brick.absorbed = ChooseAbsorbers(region.brick(i), region.Around(i), voxel_size);
    size_t rank = 0;
    brick.united->surface.ForEach([&](int local) {
      if (brick.absorbed[rank++] >= 0) brick.given_away.Set(local);
    });
  });
  std::vector<ModelLeaf> contents(recomputed);
  std::vector<uint8_t> same(recomputed);
  parallel.For(recomputed, [&](size_t i) {
    contents[i] = PublishBrick(region, i, voxel_size, all_empty);
    const ModelLeaf& before = region.before(i);
    same[i] = contents[i] == before ||
              (contents[i] != nullptr && before != nullptr && SameBits(*contents[i], *before));
  });

  MergeResult result;
  result.recomputed = recomputed;
  for (size_t i = 0; i < recomputed; ++i) {
    if (same[i] != 0) continue;
    octree.Set(region.brick(i), contents[i]);
    result.changed.push_back({region.brick(i), std::move(contents[i])});
  }
  return result;
}

}  // namespace vantage
