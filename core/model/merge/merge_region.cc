#include "core/model/merge/merge_region.h"

#include <utility>

namespace vantage::model {

MergeRegion::MergeRegion(std::span<const BrickKey> recomputed,
                         std::span<const ScanLayer* const> layers, const ModelOctree& octree,
                         const ModelLeaf& all_empty)
    : layers_(layers) {
  BrickMask all;
  all.word.fill(~uint64_t{0});
  all_empty_ = std::make_shared<const UnitedBrick>(all, BrickMask());

  recomputed_ = recomputed.size();
  for (const BrickKey key : recomputed) Add(key, octree.Find(BrickOf(key)));
  for (size_t i = 0; i < recomputed_; ++i) AddAround(i, octree, all_empty);
  with_planes_ = bricks_.size();
  for (size_t i = recomputed_; i < with_planes_; ++i) AddAround(i, octree, all_empty);

  in_layers_.reserve(bricks_.size() * layers_.size());
  for (const Member& member : bricks_) {
    for (const ScanLayer* layer : layers_) in_layers_.push_back(layer->Find(member.at));
  }
}

void MergeRegion::Add(BrickKey key, ModelLeaf before) {
  index_[key] = static_cast<int32_t>(bricks_.size());
  bricks_.push_back({BrickOf(key), std::move(before), {}});
}

void MergeRegion::AddAround(size_t i, const ModelOctree& octree, const ModelLeaf& all_empty) {
  std::array<int32_t, 27>& next = next_.emplace_back();
  next.fill(kUnknown);
  // No plane passes through it.
  if (i >= recomputed_ && bricks_[i].before == all_empty) return;
  const VoxelIndex middle = bricks_[i].at;
  size_t k = 0;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x, ++k) {
        const BrickKey key = KeyOf(middle + VoxelIndex(x, y, z));
        const auto known = index_.find(key);
        if (known != index_.end()) {
          next[k] = known->second;
          continue;
        }
        ModelLeaf before = octree.Find(BrickOf(key));
        if (before == nullptr) {
          index_[key] = kUnknown;
          continue;
        }
        const bool empty = before == all_empty;
        next[k] = static_cast<int32_t>(bricks_.size());
        Add(key, std::move(before));
        if (empty) bricks_.back().merged.united = all_empty_;
      }
    }
  }
}

BrickNeighbourhood<UnitedBrick> MergeRegion::UnitedAround(size_t i) const {
  size_t k = 0;
  return {bricks_[i].at, [&](const VoxelIndex&) -> const UnitedBrick* {
            const int32_t next = next_[i][k++];
            return next == kUnknown ? nullptr
                                    : bricks_[static_cast<size_t>(next)].merged.united.get();
          }};
}

BrickNeighbourhood<MergedBrick> MergeRegion::Around(size_t i) const {
  size_t k = 0;
  return {bricks_[i].at, [&](const VoxelIndex&) -> const MergedBrick* {
            const int32_t next = next_[i][k++];
            const bool has_planes = next != kUnknown && static_cast<size_t>(next) < with_planes_;
            return has_planes ? &bricks_[static_cast<size_t>(next)].merged : nullptr;
          }};
}

std::vector<Witness> MergeRegion::Witnesses(size_t i) const {
  std::vector<Witness> witnesses;
  for (size_t layer = 0; layer < layers_.size(); ++layer) {
    size_t k = 0;
    const BrickNeighbourhood<LayerBrick> around(
        bricks_[i].at, [&](const VoxelIndex&) -> const LayerBrick* {
          const int32_t next = next_[i][k++];
          return next == kUnknown ? nullptr : InLayers(static_cast<size_t>(next))[layer];
        });
    if (around.Any()) witnesses.push_back({layers_[layer], around});
  }
  return witnesses;
}

}  // namespace vantage::model
