#include "core/model/view/model_config.h"

#include "absl/strings/str_cat.h"
#include "core/model/view/voxel.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

absl::Status ModelConfig::Validate() const {
  if (!(voxel_size >= 0.01 && voxel_size <= 0.5)) {
    return absl::InvalidArgumentError("model: voxel_size must be in [0.01, 0.5] m");
  }
  if (!(discontinuity_angle > 0 && discontinuity_angle < sensor::kPi / 2)) {
    return absl::InvalidArgumentError("model: discontinuity_angle must be in (0, pi/2) rad");
  }
  for (int i = 0; i < 3; ++i) {
    // The octree's root spans 65,536 bricks.
    if (!(max_half_extent[i] > 0 && max_half_extent[i] <= 30000 * Brick::kSide * voxel_size)) {
      return absl::InvalidArgumentError(absl::StrCat("model: max_half_extent must be in (0, ",
                                                     30000 * Brick::kSide * voxel_size,
                                                     "] m for this voxel_size"));
    }
  }
  return absl::OkStatus();
}

}  // namespace vantage::model
