#include "core/model/merge/fuse.h"

#include <cmath>
#include <tuple>

#include "core/model/view/planning_view.h"

namespace vantage::model {

namespace {

// Cosine between normals of one surface, 37 degrees: less than half a right angle, as in alignment.
constexpr float kCompatible = 0.8f;

// Calls fn(OffsetCode, distance, brick, rank) for the voxels that dominate `plane`, the one at
// `local`. Only voxels of one column across the surface are rivals; neighbours within the surface
// are not. So at least one voxel of each column always stays.
template <typename Fn>
void ForEachDominating(const VoxelIndex& brick, const BrickNeighbourhood<MergedBrick>& around,
                       int local, const LocalPlane& plane, double voxel_size, Fn&& fn) {
  const VoxelIndex in_brick(local & 7, local >> 3 & 7, local >> 6);
  const Eigen::Vector3f centre =
      ((PlanningView::Global(brick, local).cast<double>().array() + 0.5) * voxel_size)
          .cast<float>();
  const float half = static_cast<float>(voxel_size / 2);
  for (int axis = 0; axis < 3; ++axis) {
    for (int step = -kFuseReach; step <= kFuseReach; ++step) {
      if (step == 0) continue;
      const VoxelIndex offset = step * VoxelIndex::Unit(axis);
      const VoxelIndex rival = in_brick + offset;
      const auto [there, at] = around.At(rival.x(), rival.y(), rival.z());
      if (there == nullptr || there->united == nullptr || !there->united->surface.Has(at)) continue;
      const size_t rank = there->united->Rank(at);
      const LocalPlane& other = there->plane[rank];
      // A total order, so that of two voxels exactly one can dominate.
      if (std::make_tuple(other.weight, step) <= std::make_tuple(plane.weight, 0)) continue;
      if (other.normal.dot(plane.normal) < kCompatible) continue;
      if (DominantAxis(other.normal) != axis) continue;
      const float off = std::abs(other.normal.dot(centre - other.centroid));
      if (off <= half * other.normal.lpNorm<1>()) continue;  // the surface really passes here
      fn(OffsetCode(offset.x(), offset.y(), offset.z()),
         std::abs(other.normal.dot(plane.centroid - other.centroid)), there, rank);
    }
  }
}

}  // namespace

int DominantAxis(const Eigen::Vector3f& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return axis;
}

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

}  // namespace vantage::model
