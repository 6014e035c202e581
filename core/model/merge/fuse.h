// Noise and pose errors put one wall into two layers of voxels. The voxel with less support gives
// its points to the one with more (algorithm.md section 4, 'Merge').
#ifndef VANTAGE_CORE_MODEL_MERGE_FUSE_H_
#define VANTAGE_CORE_MODEL_MERGE_FUSE_H_

#include <cstdint>
#include <vector>

#include "core/model/merge/brick_neighbourhood.h"
#include "core/model/merge/merged_brick.h"

namespace vantage::model {

// An offset of at most two voxels on each axis, as one number from 0 to 124.
constexpr int kFuseReach = 2;
constexpr int8_t OffsetCode(int dx, int dy, int dz) {
  return static_cast<int8_t>((dx + 2) + 5 * ((dy + 2) + 5 * (dz + 2)));
}

// The axis that a surface is most nearly perpendicular to.
int DominantAxis(const Eigen::Vector3f& normal);

// Marks each dominated surface voxel: one beside which, at most two voxels away across the surface,
// a voxel with more support and a similar normal has a plane that does not pass through it, so that
// its own points are there by error.
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
