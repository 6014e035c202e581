#include "core/model/merge.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/brick_neighbourhood.h"
#include "core/model/fuse.h"
#include "core/model/local_plane.h"
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

// The bricks being recomputed, and those around them as they stand.
class Region {
 public:
  Region(const ModelOctree& octree, std::vector<BrickKey> keys) : keys_(std::move(keys)) {
    fresh_.resize(keys_.size());
    for (size_t i = 0; i < keys_.size(); ++i) index_[keys_[i]] = i;
    for (const BrickKey key : keys_) {
      ForEachAround(BrickOf(key), [&](const VoxelIndex& b) {
        if (index_.contains(KeyOf(b)) || standing_.contains(KeyOf(b))) return;
        standing_[KeyOf(b)] = octree.Find(b);
      });
    }
  }

  size_t size() const { return keys_.size(); }
  VoxelIndex brick(size_t i) const { return BrickOf(keys_[i]); }
  MergedBrick& fresh(size_t i) { return fresh_[i]; }

  BrickNeighbourhood<MergedBrick> Around(size_t i) const {
    return {brick(i), [&](const VoxelIndex& b) -> const MergedBrick* {
              const auto it = index_.find(KeyOf(b));
              if (it != index_.end()) return &fresh_[it->second];
              return standing_.find(KeyOf(b))->second.get();
            }};
  }
  BrickNeighbourhood<UnitedBrick> UnitedAround(size_t i) const {
    const BrickNeighbourhood<MergedBrick> around = Around(i);
    size_t k = 0;
    return {brick(i), [&](const VoxelIndex&) -> const UnitedBrick* {
              const MergedBrick* there = around.all()[k++];
              return there == nullptr ? nullptr : there->united.get();
            }};
  }

 private:
  std::vector<BrickKey> keys_;
  absl::flat_hash_map<BrickKey, size_t> index_;
  std::vector<MergedBrick> fresh_;
  absl::flat_hash_map<BrickKey, std::shared_ptr<const MergedBrick>> standing_;
};

// The bricks that the layer can have an influence on, ascending.
std::vector<BrickKey> Influenced(const ScanLayer& touched, LayerChange change,
                                 std::span<const BrickKey> also, const ModelOctree& octree,
                                 const std::shared_ptr<const MergedBrick>& all_empty) {
  const auto stays_empty = [&](const VoxelIndex& b) {
    const LayerBrick* own = touched.Find(b);
    return (own == nullptr || AllEmpty(own->empty)) && octree.Find(b) == all_empty;
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

std::shared_ptr<const MergedBrick> MakeAllEmpty() {
  auto united = std::make_shared<UnitedBrick>();
  united->empty.word.fill(~uint64_t{0});
  auto contents = std::make_shared<Brick>();
  contents->state.fill(VoxelState::kEmpty);
  auto brick = std::make_shared<MergedBrick>();
  brick->united = std::move(united);
  brick->contents = std::move(contents);
  return brick;
}

size_t MergeAround(const ScanLayer& touched, LayerChange change, std::span<const BrickKey> also,
                   std::span<const ScanLayer* const> layers, double voxel_size,
                   const std::shared_ptr<const MergedBrick>& all_empty, Parallel& parallel,
                   ModelOctree& octree) {
  Region region(octree, Influenced(touched, change, also, octree, all_empty));
  const size_t count = region.size();

  // Each stage reads what the one before wrote, in the bricks around too, so each is a loop of its
  // own. A voxel's influence reaches eight voxels: no farther than the next brick.
  parallel.For(count, [&](size_t i) { region.fresh(i).united = Unite(region.brick(i), layers); });
  parallel.For(count, [&](size_t i) {
    if (region.fresh(i).united == nullptr || region.fresh(i).united->sums.empty()) return;
    region.fresh(i).fitted = FitPlanes(region.brick(i), region.UnitedAround(i), layers, voxel_size);
  });
  parallel.For(count, [&](size_t i) {
    if (region.fresh(i).fitted.empty()) return;
    region.fresh(i).plane = SnapToFlatNeighbours(region.Around(i), voxel_size);
  });
  parallel.For(count, [&](size_t i) {
    if (region.fresh(i).plane.empty()) return;
    region.fresh(i).dominated = FindDominated(region.brick(i), region.Around(i), voxel_size);
  });
  parallel.For(count, [&](size_t i) {
    if (region.fresh(i).plane.empty()) return;
    region.fresh(i).absorbed = ChooseAbsorbers(region.brick(i), region.Around(i), voxel_size);
  });
  std::vector<std::shared_ptr<const Brick>> contents(count);
  parallel.For(count, [&](size_t i) {
    contents[i] =
        PublishBrick(region.brick(i), region.Around(i), layers, voxel_size, all_empty->contents);
  });

  for (size_t i = 0; i < count; ++i) {
    if (contents[i] == nullptr) {
      octree.Set(region.brick(i), nullptr);
    } else if (contents[i] == all_empty->contents) {
      octree.Set(region.brick(i), all_empty);
    } else {
      MergedBrick& fresh = region.fresh(i);
      fresh.contents = contents[i];
      octree.Set(region.brick(i), std::make_shared<const MergedBrick>(std::move(fresh)));
    }
  }
  octree.Collapse();
  return count;
}

}  // namespace vantage
