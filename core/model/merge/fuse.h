// Noise and pose errors put one wall into two layers of voxels: the weaker gives itself to the
// stronger (algorithm.md section 4, 'Merge').
#ifndef VANTAGE_CORE_MODEL_MERGE_FUSE_H_
#define VANTAGE_CORE_MODEL_MERGE_FUSE_H_

#include <cstdint>
#include <vector>

#include "core/model/merge/brick_neighbourhood.h"
#include "core/model/merge/merged_brick.h"

namespace vantage::model {

// The 125 voxels at most two away, as one number.
constexpr int kFuseReach = 2;
constexpr int8_t OffsetCode(int dx, int dy, int dz) {
  return static_cast<int8_t>((dx + 2) + 5 * ((dy + 2) + 5 * (dz + 2)));
}

// The axis that a surface is most nearly perpendicular to.
int DominantAxis(const Eigen::Vector3f& normal);

// Marks each surface voxel that a better supported voxel with a similar normal, at most two away
// across the surface, makes superfluous: that voxel's plane does not pass through it, so its points
// are there by error.
std::vector<uint8_t> FindDominated(const VoxelIndex& brick,
                                   const BrickNeighbourhood<MergedBrick>& around,
                                   double voxel_size);

// For each dominated voxel the nearest dominating one that is not dominated itself (its
// OffsetCode), else -1: it stays.
std::vector<int8_t> ChooseAbsorbers(const VoxelIndex& brick,
                                    const BrickNeighbourhood<MergedBrick>& around,
                                    double voxel_size);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_FUSE_H_
