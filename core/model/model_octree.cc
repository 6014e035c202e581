#include "core/model/model_octree.h"

#include <utility>

namespace vantage {

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
  // A leaf of nothing rather than none: OctoMap leaks inner nodes that lose their last child.
  if (leaf == nullptr && (root == nullptr || search(key) == nullptr)) return;
  if (root == nullptr) {
    root = new ModelNode();
    ++tree_size;
  }
  ModelNode* node = root;
  for (unsigned level = tree_depth; level > 0; --level) {
    const unsigned child = octomap::computeChildIdx(key, static_cast<int>(level) - 1);
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
}

}  // namespace vantage
