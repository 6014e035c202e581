// The floor on which a scanner stood (algorithm.md section 4, 'Where a scanner stood').
#ifndef VANTAGE_CORE_MODEL_CARVE_FLOOR_BELOW_H_
#define VANTAGE_CORE_MODEL_CARVE_FLOOR_BELOW_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>

#include "core/model/carve/scan_layer.h"

namespace vantage::model {

// A floor near the station: level, or rising on a slope.
struct FloorPlane {
  double height = 0;                               // m, at the station
  Eigen::Vector2d rise = Eigen::Vector2d::Zero();  // m per m
  size_t columns = 0;                              // of voxels that lie on it

  // `aside`: m in plan from the station.
  double At(const Eigen::Vector2d& aside) const { return height + rise.dot(aside); }
};

// Found from the layer's own surface; nothing where none of it can be the tripod's.
std::optional<FloorPlane> FloorBelow(double voxel_size, const ScanLayer& layer);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_FLOOR_BELOW_H_
