#include "core/model/fuse.h"

#include <cmath>
#include <tuple>

#include "core/model/planning_view.h"

namespace vantage {

namespace {

constexpr float kCompatible = 0.8f;  // cosine between normals of one surface

// Calls fn(code, plane, brick, local) for the voxels around (x, y, z) that dominate `plane`.
template <typename Fn>
void ForEachDominating(const VoxelIndex& brick, const BrickNeighbourhood<MergedBrick>& around,
                       int local, const LocalPlane& plane, double voxel_size, Fn&& fn) {
  const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
  const VoxelIndex voxel = PlanningView::Global(brick, local);
  const Eigen::Vector3f centre = ((voxel.cast<double>().array() + 0.5) * voxel_size).cast<float>();
  const float half = static_cast<float>(voxel_size / 2);
  for (int dz = -kFuseReach; dz <= kFuseReach; ++dz) {
    for (int dy = -kFuseReach; dy <= kFuseReach; ++dy) {
      for (int dx = -kFuseReach; dx <= kFuseReach; ++dx) {
        const auto [there, at] = around.At(x + dx, y + dy, z + dz);
        if (there == nullptr || there->united == nullptr || !there->united->surface.Has(at)) {
          continue;
        }
        const size_t rank = static_cast<size_t>(there->united->surface.Rank(at));
        const LocalPlane& other = there->plane[rank];
        // A total order, so that of two voxels exactly one can dominate.
        if (std::make_tuple(other.weight, dz, dy, dx) <= std::make_tuple(plane.weight, 0, 0, 0)) {
          continue;
        }
        if (other.normal.dot(plane.normal) < kCompatible) continue;
        // Beside it in the surface is no rival: only one in front or behind is.
        const Eigen::Vector3f apart = plane.centroid - other.centroid;
        const float along = std::abs(other.normal.dot(apart));
        if ((apart - other.normal.dot(apart) * other.normal).norm() > 1.5f * 2 * half) continue;
        if (along > 2.5f * 2 * half) continue;
        const float through = std::abs(other.normal.dot(centre - other.centroid));
        if (through <= half * other.normal.lpNorm<1>()) continue;  // really passes here
        fn(OffsetCode(dx, dy, dz), along, there, rank);
      }
    }
  }
}

}  // namespace

std::vector<uint8_t> FindDominated(const VoxelIndex& brick,
                                   const BrickNeighbourhood<MergedBrick>& around,
                                   double voxel_size) {
  const MergedBrick& own = *around.middle();
  std::vector<uint8_t> dominated(own.plane.size(), 0);
  size_t rank = 0;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    if (!own.united->surface.Has(local)) continue;
    ForEachDominating(brick, around, local, own.plane[rank], voxel_size,
                      [&](int8_t, float, const MergedBrick*, size_t) { dominated[rank] = 1; });
    ++rank;
  }
  return dominated;
}

std::vector<int8_t> ChooseAbsorbers(const VoxelIndex& brick,
                                    const BrickNeighbourhood<MergedBrick>& around,
                                    double voxel_size) {
  const MergedBrick& own = *around.middle();
  std::vector<int8_t> absorbed(own.plane.size(), -1);
  size_t rank = 0;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    if (!own.united->surface.Has(local)) continue;
    if (own.dominated[rank] != 0) {
      float nearest = 1e9f;
      ForEachDominating(brick, around, local, own.plane[rank], voxel_size,
                        [&](int8_t code, float along, const MergedBrick* there, size_t i) {
                          if (there->dominated[i] == 0 && along < nearest) {
                            nearest = along;
                            absorbed[rank] = code;
                          }
                        });
    }
    ++rank;
  }
  return absorbed;
}

}  // namespace vantage
