#include "core/model/merge/model_octree.h"

#include <array>
#include <utility>

namespace vantage::model {

ModelOctree::ModelOctree(double voxel_size) : OcTreeBaseImpl(voxel_size * Brick::kSide) {}

octomap::OcTreeKey ModelOctree::KeyAt(const VoxelIndex& brick) {
  return {static_cast<octomap::key_type>(brick.x() + kOrigin),
          static_cast<octomap::key_type>(brick.y() + kOrigin),
          static_cast<octomap::key_type>(brick.z() + kOrigin)};
}

ModelLeaf ModelOctree::Find(const VoxelIndex& brick) const {
  const ModelNode* node = search(KeyAt(brick));
  return node == nullptr ? nullptr : node->getValue();
}

void ModelOctree::Set(const VoxelIndex& brick, ModelLeaf leaf) {
  const octomap::OcTreeKey key = KeyAt(brick);
  // An unknown brick becomes a leaf without contents instead of no leaf: OctoMap leaks inner nodes
  // that lose their last child.
  if (leaf == nullptr && (root == nullptr || Find(brick) == nullptr)) return;
  if (root == nullptr) {
    root = new ModelNode();
    ++tree_size;
  }
  std::array<ModelNode*, kLevels + 1> path;
  ModelNode* node = root;
  for (unsigned above = tree_depth; above > 0; --above) {
    path[above] = node;
    const unsigned child = octomap::computeChildIdx(key, static_cast<int>(above) - 1);
    if (!nodeChildExists(node, child)) {
      if (!nodeHasChildren(node) && node->getValue() != nullptr) {
        expandNode(node);  // was joined
      } else {
        createNodeChild(node, child);
      }
      node->setValue(nullptr);  // inner nodes say nothing themselves
    }
    node = getNodeChild(node, child);
  }
  node->setValue(std::move(leaf));
  size_changed = true;
  // Up to the root's children, as OctoMap prunes, but where something changed only.
  unsigned level = 1;
  while (level < tree_depth && pruneNode(path[level])) ++level;
}

}  // namespace vantage::model
