// Tells whether a scan sees through a voxel: by the range in the direction of its centre or, where
// that direction tells nothing, by the rays that cross the voxel.
#ifndef VANTAGE_CORE_MODEL_CARVE_VOXEL_VISIBILITY_H_
#define VANTAGE_CORE_MODEL_CARVE_VOXEL_VISIBILITY_H_

#include <Eigen/Geometry>
#include <cstdint>

#include "core/model/scan/range_surface.h"
#include "core/model/view/voxel.h"

namespace vantage::model {

class VoxelVisibility {
 public:
  static constexpr int kSide = 4;  // voxels

  // The surface is kept: it outlives this.
  VoxelVisibility(const RangeSurface& surface, const Eigen::Isometry3d& T_model_scan,
                  double voxel_size);

  // Bit x + 4 (y + 4 z) of each set stands for a voxel of the block.
  struct Block {
    uint64_t empty = 0;   // the range in the direction of the centre is farther than the centre
    uint64_t untold = 0;  // nothing is known in that direction
  };
  // The block from voxel `corner` on. Directions are good to 1e-6 rad.
  Block Test(const VoxelIndex& corner) const;

  // Close to the scanner many rays cross a voxel, not only the one through its centre. The voxel is
  // empty when enough of them tell a range and most of these pass through it.
  bool MostRaysPass(const VoxelIndex& voxel) const;

 private:
  const RangeSurface& surface_;
  double voxel_size_;
  Eigen::Vector3d origin_;
  Eigen::Matrix3d R_scan_model_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_VOXEL_VISIBILITY_H_
