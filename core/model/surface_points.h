// The surface that a scan measured, and what joined samples imply between them, into voxels.
#ifndef VANTAGE_CORE_MODEL_SURFACE_POINTS_H_
#define VANTAGE_CORE_MODEL_SURFACE_POINTS_H_

#include <array>
#include <vector>

#include "core/model/scan_layer.h"
#include "core/parallel/parallel.h"

namespace vantage {

// Points of surface, summed by voxel. Integers, so the order of adding does not matter.
class SurfacePoints {
 public:
  explicit SurfacePoints(double voxel_size) : voxel_size_(voxel_size) {}

  void Add(const Eigen::Vector3d& point, bool measured);

  // Adds what was summed to the layer's bricks.
  void AddTo(ScanLayer& layer) const;

 private:
  struct BrickSums {
    std::array<int16_t, Brick::kVoxels> slot;
    std::vector<SurfaceSums> sums;
  };
  double voxel_size_;
  absl::flat_hash_map<BrickKey, size_t> index_;
  std::vector<std::pair<BrickKey, BrickSums>> bricks_;
  BrickKey last_key_ = ~BrickKey{0};  // neighbouring samples mostly share a brick
  size_t last_ = 0;
};

// The samples, and points interpolated on joined quads and triangles that reach into several
// voxels, at most a third of a voxel apart.
void AddSurfacePoints(double voxel_size, Parallel& parallel, ScanLayer& layer);

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_SURFACE_POINTS_H_
