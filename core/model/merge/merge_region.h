// The bricks that a merge recomputes, and those around them that it reads.
#ifndef VANTAGE_CORE_MODEL_MERGE_MERGE_REGION_H_
#define VANTAGE_CORE_MODEL_MERGE_MERGE_REGION_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/carve/scan_layer.h"
#include "core/model/merge/brick_neighbourhood.h"
#include "core/model/merge/merged_brick.h"
#include "core/model/merge/model_octree.h"

namespace vantage::model {

// A scan that says something of a brick or of one next to it.
struct Witness {
  const ScanLayer* layer;
  BrickNeighbourhood<LayerBrick> around;
};

// What is published of a voxel depends on voxels at most nine away: on what absorbs it (two
// voxels), on what dominates that one (two), on their planes (two), which may be those of flat
// neighbours (two), and on the points next to these (one). So planes are needed of the bricks that
// are recomputed and of those next to them, where they are right as far as they are read; and
// points of the bricks next to these, too. All of this follows from the layers and is kept only for
// the time of the merge.
class MergeRegion {
 public:
  // `recomputed`: ascending, each brick once. `layers` and their bricks outlive this.
  MergeRegion(std::span<const BrickKey> recomputed, std::span<const ScanLayer* const> layers,
              const ModelOctree& octree, const ModelLeaf& all_empty);

  // Bricks are numbered in this order: those recomputed, those that need planes, and those that
  // need points only. Unknown bricks around them are left out.
  size_t recomputed() const { return recomputed_; }
  size_t with_planes() const { return with_planes_; }
  size_t with_points() const { return bricks_.size(); }

  const VoxelIndex& brick(size_t i) const { return bricks_[i].at; }
  // The brick before the merge.
  const ModelLeaf& before(size_t i) const { return bricks_[i].before; }
  MergedBrick& merged(size_t i) { return bricks_[i].merged; }
  std::span<const ScanLayer* const> layers() const { return layers_; }
  // The brick in each layer, null where the layer holds nothing of it.
  std::span<const LayerBrick* const> InLayers(size_t i) const {
    return std::span(in_layers_).subspan(i * layers_.size(), layers_.size());
  }

  // For bricks with planes.
  BrickNeighbourhood<UnitedBrick> UnitedAround(size_t i) const;
  // The same; those with points only are left out.
  BrickNeighbourhood<MergedBrick> Around(size_t i) const;
  // For recomputed bricks, in order of the layers.
  std::vector<Witness> Witnesses(size_t i) const;

 private:
  static constexpr int32_t kUnknown = -1;

  struct Member {
    VoxelIndex at;
    ModelLeaf before;
    MergedBrick merged;
  };

  void Add(BrickKey key, ModelLeaf before);
  // Adds what is known next to a brick.
  void AddAround(size_t i, const ModelOctree& octree, const ModelLeaf& all_empty);

  std::span<const ScanLayer* const> layers_;
  std::vector<Member> bricks_;
  absl::flat_hash_map<BrickKey, int32_t> index_;
  std::vector<std::array<int32_t, 27>> next_;     // of bricks with planes: by z, y, x
  std::vector<const LayerBrick*> in_layers_;      // by brick, then by layer
  std::shared_ptr<const UnitedBrick> all_empty_;  // of which every voxel is empty
  size_t recomputed_ = 0;
  size_t with_planes_ = 0;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_MERGE_REGION_H_
