#include "core/model/merge/reflection_mask.h"

#include <algorithm>
#include <utility>

namespace vantage::model {

namespace {

// The voxels of a brick that lie behind the aperture as seen from the station.
BrickMask SeenThrough(const Aperture& aperture, const Eigen::Vector3d& station,
                      const VoxelIndex& brick, double voxel_size) {
  BrickMask hidden;
  const double side = Brick::kSide * voxel_size;
  const Eigen::Vector3d middle = (brick.cast<double>().array() + 0.5) * side;
  if (!aperture.MayHide(station, middle, side)) return hidden;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    const Eigen::Vector3d centre =
        (PlanningView::Global(brick, local).cast<double>().array() + 0.5) * voxel_size;
    // A voxel nearer to the plane than its own width may be the reflector itself.
    if (aperture.Above(centre) > -voxel_size) continue;
    if (aperture.Between(station, centre)) hidden.Set(local);
  }
  return hidden;
}

bool Overlaps(const BrickMask& mask, const LayerBrick& brick) {
  for (size_t w = 0; w < mask.word.size(); ++w) {
    if ((mask.word[w] & (brick.empty.word[w] | brick.surface.word[w])) != 0) return true;
  }
  return false;
}

LayerBrick Without(const LayerBrick& brick, const BrickMask& hidden) {
  LayerBrick left;
  for (size_t w = 0; w < hidden.word.size(); ++w) {
    left.empty.word[w] = brick.empty.word[w] & ~hidden.word[w];
    left.surface.word[w] = brick.surface.word[w] & ~hidden.word[w];
  }
  size_t rank = 0;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    if (!brick.surface.Has(local)) continue;
    if (left.surface.Has(local)) left.sums.push_back(brick.sums[rank]);
    ++rank;
  }
  return left;
}

}  // namespace

std::vector<BrickKey> ApplyReflectionMask(std::span<const Aperture> apertures, double voxel_size,
                                          ScanLayer& layer) {
  std::vector<BrickKey> changed;
  for (auto& [key, whole] : layer.set_aside) {
    changed.push_back(key);
    layer.bricks.Put(key, std::move(whole));
  }
  layer.set_aside.clear();
  layer.apertures.assign(apertures.begin(), apertures.end());
  const Eigen::Vector3d station = layer.T_model_scan.translation();
  for (const Aperture& aperture : apertures) {
    std::vector<std::pair<BrickKey, BrickMask>> hidden;
    layer.bricks.ForEach([&](BrickKey key, const LayerBrick& brick) {
      const BrickMask mask = SeenThrough(aperture, station, BrickOf(key), voxel_size);
      if (Overlaps(mask, brick)) hidden.emplace_back(key, mask);
    });
    for (const auto& [key, mask] : hidden) {
      LayerBrick whole = layer.bricks.Take(key);
      LayerBrick left = Without(whole, mask);
      layer.set_aside.try_emplace(key, std::move(whole));
      if (left.Any()) layer.bricks.Put(key, std::move(left));
      changed.push_back(key);
    }
  }
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  return changed;
}

}  // namespace vantage::model
