#include "core/model/merge/model_octree.h"

#include <array>
#include <utility>

#include "core/model/view/brick_pages.h"

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

void ModelOctree::SetCube(const VoxelIndex& first, unsigned level, ModelLeaf leaf) {
  const octomap::OcTreeKey key = KeyAt(first);
  // An unknown brick becomes a leaf without contents instead of no leaf: OctoMap leaks inner nodes
  // that lose their last child.
  if (leaf == nullptr && (root == nullptr || Find(first) == nullptr)) return;
  if (root == nullptr) {
    root = new ModelNode();
    ++tree_size;
  }
  std::array<ModelNode*, kLevels + 1> path;
  ModelNode* node = root;
  for (unsigned above = tree_depth; above > level; --above) {
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
  unsigned above = level + 1;
  while (above < tree_depth && pruneNode(path[above])) ++above;
}

const ModelNode* ModelOctree::NodeOf(const VoxelIndex& page) const {
  const octomap::OcTreeKey key = KeyAt(page * BrickPage::kSide);
  const ModelNode* node = root;
  for (unsigned above = tree_depth; node != nullptr && above > kPageLevel; --above) {
    if (!nodeHasChildren(node)) return node;  // was joined, or is unknown
    const unsigned child = octomap::computeChildIdx(key, static_cast<int>(above) - 1);
    node = nodeChildExists(node, child) ? getNodeChild(node, child) : nullptr;
  }
  return node;
}

void ModelOctree::Collect(const ModelNode& node, const VoxelIndex& first, int side,
                          const ModelLeaf& leaf, PageContents& contents) const {
  if (nodeHasChildren(&node)) {
    const int half = side / 2;
    for (unsigned child = 0; child < 8; ++child) {
      if (!nodeChildExists(&node, child)) continue;
      const auto at = static_cast<int>(child);
      Collect(*getNodeChild(&node, child), first + half * VoxelIndex(at & 1, at >> 1 & 1, at >> 2),
              half, leaf, contents);
    }
    return;
  }
  if (node.getValue() == nullptr) return;
  const bool same = node.getValue() == leaf;
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const int local = Brick::LocalOf(first + VoxelIndex(x, y, z));
        contents.known.Set(local);
        if (same) contents.same.Set(local);
      }
    }
  }
}

ModelOctree::PageContents ModelOctree::In(const VoxelIndex& page, const ModelLeaf& leaf) const {
  PageContents contents;
  const ModelNode* node = NodeOf(page);
  if (node != nullptr) Collect(*node, VoxelIndex::Zero(), BrickPage::kSide, leaf, contents);
  return contents;
}

void ModelOctree::SetUnknown(const VoxelIndex& page, const BrickMask& bricks,
                             const ModelLeaf& leaf) {
  const VoxelIndex first = page * BrickPage::kSide;
  if (bricks.All() && NodeOf(page) == nullptr) {
    SetCube(first, kPageLevel, leaf);
    return;
  }
  bricks.ForEach(
      [&](int local) { Set(first + VoxelIndex(local & 7, local >> 3 & 7, local >> 6), leaf); });
}

}  // namespace vantage::model
