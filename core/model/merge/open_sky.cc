#include "core/model/merge/open_sky.h"

#include <array>
#include <cmath>

#include "core/model/merge/brick_set.h"
#include "core/model/scan/sky.h"

namespace vantage::model {
namespace {

Eigen::Vector3d CentreOf(const VoxelIndex& brick, int local, double voxel_size) {
  return (PlanningView::Global(brick, local).cast<double>().array() + 0.5) * voxel_size;
}

// A brick and those beside its faces; null where all is unknown.
class BrickAndFaces {
 public:
  BrickAndFaces(const VoxelIndex& brick, const ModelOctree& octree) : middle_(octree.Find(brick)) {
    for (size_t face = 0; face < beside_.size(); ++face) {
      VoxelIndex next = brick;
      next[static_cast<int>(face / 2)] += face % 2 == 0 ? -1 : 1;
      beside_[face] = octree.Find(next);
    }
  }

  bool Unknown(int local) const { return StateIn(middle_, local) == VoxelState::kUnknown; }

  bool BesideEmpty(int local) const {
    for (int face = 0; face < 6; ++face) {
      const int shift = 3 * (face / 2);
      const int along = (local >> shift & 7) + (face % 2 == 0 ? -1 : 1);
      const bool outside = along < 0 || along >= Brick::kSide;
      const int next = (local & ~(7 << shift)) | (along & 7) << shift;
      const ModelLeaf& leaf = outside ? beside_[static_cast<size_t>(face)] : middle_;
      if (StateIn(leaf, next) == VoxelState::kEmpty) return true;
    }
    return false;
  }

 private:
  static VoxelState StateIn(const ModelLeaf& leaf, int local) {
    return leaf == nullptr ? VoxelState::kUnknown : leaf->state[static_cast<size_t>(local)];
  }

  ModelLeaf middle_;
  std::array<ModelLeaf, 6> beside_;
};

}  // namespace

bool MayHaveSky(const ScanLayer& layer, const VoxelIndex& brick, double voxel_size) {
  if (!layer.range_surface.EndsInSky()) return false;
  const double side = Brick::kSide * voxel_size;
  const Eigen::Vector3d middle = (brick.cast<double>().array() + 0.5) * side;
  // The brick is larger than the two voxels that InSky() adds.
  const double reach = SkyRange(layer.scanner) + std::sqrt(3.0) * side;
  return (middle - layer.T_model_scan.translation()).squaredNorm() <= reach * reach;
}

std::vector<BrickKey> BricksThatSkyClears(const ScanLayer& layer, const ModelOctree& octree,
                                          double voxel_size) {
  std::vector<BrickKey> found;
  if (!layer.range_surface.EndsInSky()) return found;
  octree.ForEach([&](const VoxelIndex& brick, const ModelLeaf& leaf) {
    if (leaf->surface.empty() || !MayHaveSky(layer, brick, voxel_size)) return;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (IsFalseSurface(leaf->state[static_cast<size_t>(local)]) &&
          layer.InSky(CentreOf(brick, local, voxel_size), voxel_size)) {
        found.push_back(KeyOf(brick));
        return;
      }
    }
  });
  return found;
}

std::vector<BrickKey> BricksThatSkyCleared(const ScanLayer& layer, const ModelOctree& octree,
                                           const ModelLeaf& all_empty, double voxel_size) {
  std::vector<BrickKey> found;
  if (!layer.range_surface.EndsInSky()) return found;
  BrickSet known;
  BrickSet whole;
  octree.ForEach([&](const VoxelIndex& brick, const ModelLeaf& leaf) {
    if (!MayHaveSky(layer, brick, voxel_size)) return;
    known.Add(brick);
    if (leaf == all_empty) whole.Add(brick);
  });
  BrickSet candidates = known.Grown();
  candidates.Remove(whole);
  for (const BrickKey key : candidates.Keys()) {
    const VoxelIndex brick = BrickOf(key);
    const BrickAndFaces around(brick, octree);
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (around.Unknown(local) && around.BesideEmpty(local) &&
          layer.InSky(CentreOf(brick, local, voxel_size), voxel_size)) {
        found.push_back(key);
        break;
      }
    }
  }
  return found;
}

}  // namespace vantage::model
