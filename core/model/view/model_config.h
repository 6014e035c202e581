// How a model is made: the size of its voxels and the extent of its site.
#ifndef VANTAGE_CORE_MODEL_VIEW_MODEL_CONFIG_H_
#define VANTAGE_CORE_MODEL_VIEW_MODEL_CONFIG_H_

#include <Eigen/Core>

#include "absl/status/status.h"

namespace vantage::model {

struct ModelConfig {
  double voxel_size = 0.05;  // m, [0.01, 0.5]
  // Neighbouring samples are one surface unless the segment between them makes less than this angle
  // with the line of sight, rad. 8 degrees: beyond 82 degrees of incidence, past the maximum
  // incidence at which samples count. An angle, so that it holds for any step.
  double discontinuity_angle = 0.14;
  // The limit of the site: a box (m, around the model's origin, half side per axis). Scanners stand
  // within it; what they measure beyond is cut.
  Eigen::Vector3d max_half_extent = Eigen::Vector3d(200, 200, 50);

  absl::Status Validate() const;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_MODEL_CONFIG_H_
