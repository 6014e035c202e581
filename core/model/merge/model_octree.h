// The site's octree: OctoMap's tree with nodes of our own. Its leaves are bricks of 8 x 8 x 8
// voxels; equal empty bricks are one node.
#ifndef VANTAGE_CORE_MODEL_MERGE_MODEL_OCTREE_H_
#define VANTAGE_CORE_MODEL_MERGE_MODEL_OCTREE_H_

#include <octomap/AbstractOcTree.h>
#include <octomap/OcTreeBaseImpl.h>
#include <octomap/OcTreeDataNode.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/model/view/brick_mask.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

// True when the octree can hold a brick there.
inline bool IsInOctree(const VoxelIndex& brick) {
  constexpr int kReach = 32767;
  return (brick.array() >= -kReach).all() && (brick.array() < kReach).all();
}

// What a leaf says of its cube: all that merging keeps of a brick is what is published, since the
// rest follows from the scans' layers. Null is unknown.
using ModelLeaf = std::shared_ptr<const Brick>;

class ModelNode : public octomap::OcTreeDataNode<ModelLeaf> {
 public:
  using octomap::OcTreeDataNode<ModelLeaf>::OcTreeDataNode;
  // OctoMap calls this when a child is removed. Inner nodes hold nothing of their own, and ours
  // never lose a child, but OctoMap's templates need the function.
  void updateOccupancyChildren() {}
};

class ModelOctree : public octomap::OcTreeBaseImpl<ModelNode, octomap::AbstractOcTree> {
 public:
  explicit ModelOctree(double voxel_size);

  // The brick at brick coordinates, or null where all is unknown.
  ModelLeaf Find(const VoxelIndex& brick) const;
  // Sets a brick; null is unknown. Bricks lie within +-32,768 of the origin. Equal bricks (the same
  // shared contents) that fill a larger cube become one node.
  void Set(const VoxelIndex& brick, ModelLeaf leaf) { SetCube(brick, 0, std::move(leaf)); }
  // The same for bricks of a page (8 x 8 x 8 bricks) that are unknown; `leaf` is not null.
  void SetUnknown(const VoxelIndex& page, const BrickMask& bricks, const ModelLeaf& leaf);

  // The bricks of a page that are not unknown, and those of them that are this leaf.
  struct PageContents {
    BrickMask known;
    BrickMask same;
  };
  PageContents In(const VoxelIndex& page, const ModelLeaf& leaf) const;

  // Calls fn(brick coordinates, leaf) for every brick that is not unknown, joined ones one by one.
  template <typename Fn>
  void ForEach(Fn&& fn) const {
    for (auto it = begin_leafs(), end = end_leafs(); it != end; ++it) {
      if (it->getValue() == nullptr) continue;
      const int side = 1 << (getTreeDepth() - it.getDepth());
      const octomap::OcTreeKey key = it.getIndexKey();
      for (int z = 0; z < side; ++z) {
        for (int y = 0; y < side; ++y) {
          for (int x = 0; x < side; ++x) {
            fn(VoxelIndex(key[0] + x - kOrigin, key[1] + y - kOrigin, key[2] + z - kOrigin),
               it->getValue());
          }
        }
      }
    }
  }

  ModelOctree* create() const override { return new ModelOctree(resolution / Brick::kSide); }
  std::string getTreeType() const override { return "VantageModelOctree"; }

 private:
  static constexpr int kOrigin = 32768;
  static constexpr unsigned kLevels = 16;  // OctoMap's
  static constexpr unsigned kPageLevel = 3;
  static octomap::OcTreeKey KeyAt(const VoxelIndex& brick);
  // Of the cube of 2^level bricks a side whose first brick this is; its node has no children.
  void SetCube(const VoxelIndex& first, unsigned level, ModelLeaf leaf);
  // The node of a page, or of a joined cube that holds it; null where all is unknown.
  const ModelNode* NodeOf(const VoxelIndex& page) const;
  void Collect(const ModelNode& node, const VoxelIndex& first, int side, const ModelLeaf& leaf,
               PageContents& contents) const;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_MODEL_OCTREE_H_
