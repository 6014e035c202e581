#include "core/model/merge/publish_region.h"

#include "core/model/merge/fuse.h"
#include "core/model/merge/local_plane.h"
#include "core/model/merge/publish_brick.h"
#include "core/model/merge/unite.h"

namespace vantage::model {

std::vector<ModelLeaf> PublishRegion(MergeRegion& region, std::span<const ScanLayer* const> layers,
                                     double voxel_size, const ModelLeaf& all_empty,
                                     parallel::Parallel& parallel) {
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
    std::vector<LocalPlane>().swap(brick.fitted);  // no longer needed
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
  std::vector<ModelLeaf> contents(region.recomputed());
  parallel.For(contents.size(),
               [&](size_t i) { contents[i] = PublishBrick(region, i, voxel_size, all_empty); });
  return contents;
}

bool SameContents(const ModelLeaf& a, const ModelLeaf& b) {
  if (a == b) return true;
  return a != nullptr && b != nullptr && a->state == b->state && a->dropouts == b->dropouts &&
         a->surface == b->surface;
}

}  // namespace vantage::model
