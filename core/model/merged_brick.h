// One brick of the merged model: what the scans add up to, and what follows from it.
#ifndef VANTAGE_CORE_MODEL_MERGED_BRICK_H_
#define VANTAGE_CORE_MODEL_MERGED_BRICK_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/model/scan_layer.h"
#include "core/model/voxel.h"

namespace vantage {

// The union of the scans' layers in one brick.
struct UnitedBrick {
  BrickMask empty;                // seen empty by a scan, surface to none
  BrickMask surface;              // surface to a scan, and not seen through by several
  std::vector<SurfaceSums> sums;  // of the voxels in `surface`, in order of local
};

// The plane through a surface voxel's neighbourhood.
struct LocalPlane {
  Eigen::Vector3f centroid = Eigen::Vector3f::Zero();  // m, of the voxel's own points
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    // unit, towards the scanners
  float flatness = 0;   // m, rms distance of the neighbourhood's points from the plane
  uint32_t weight = 0;  // points in the voxel, measured ones first
};

// Every part is immutable and shared between versions of the model. Parts of the same index belong
// to the same surface voxel.
struct MergedBrick {
  std::shared_ptr<const UnitedBrick> united;
  std::vector<LocalPlane> fitted;         // by the neighbourhood alone
  std::vector<LocalPlane> plane;          // at edges, that of the best neighbouring plane
  std::vector<uint8_t> dominated;         // a better supported neighbour says the same surface
  std::vector<int8_t> absorbed;           // -1, or into which of the 125 voxels around
  std::shared_ptr<const Brick> contents;  // what is published
};

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_MERGED_BRICK_H_
