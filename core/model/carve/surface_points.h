// The surface that a scan measured, and what joined samples imply between them, into voxels.
#ifndef VANTAGE_CORE_MODEL_CARVE_SURFACE_POINTS_H_
#define VANTAGE_CORE_MODEL_CARVE_SURFACE_POINTS_H_

#include <array>
#include <utility>
#include <vector>

#include "core/model/carve/carve_room.h"
#include "core/model/carve/scan_layer.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// Points of surface, summed by voxel. Integers, so the order of adding does not matter.
class SurfacePoints {
 public:
  void Add(const VoxelIndex& voxel, const SurfaceSums& sums);
  // One interpolated point (m, model frame).
  void AddInterpolated(const Eigen::Vector3d& point, double voxel_size);

  size_t voxels() const { return voxels_; }

  // Adds what was summed to the layer's bricks.
  void AddTo(ScanLayer& layer) const;

 private:
  struct BrickSums {
    BrickMask held;
    std::array<int16_t, Brick::kVoxels> slot;  // in `sums`, of the voxels held
    std::vector<SurfaceSums> sums;
  };
  absl::flat_hash_map<BrickKey, size_t> index_;
  std::vector<std::pair<BrickKey, BrickSums>> bricks_;
  BrickKey last_key_ = ~BrickKey{0};  // neighbouring samples mostly share a brick
  size_t last_ = 0;
  size_t voxels_ = 0;  // that hold any
};

// The samples, and points interpolated on joined quads and triangles that reach into several
// voxels, at most a third of a voxel apart. When the room is spent, the layer stays without them.
void AddSurfacePoints(double voxel_size, parallel::Parallel& parallel, CarveRoom& room,
                      ScanLayer& layer);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_SURFACE_POINTS_H_
