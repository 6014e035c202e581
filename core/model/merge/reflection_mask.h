// What one scan found to reflect holds for all of them: no ray goes through a mirror, even where a
// scan by itself could not tell (algorithm.md section 4, 'What never comes').
#ifndef VANTAGE_CORE_MODEL_MERGE_REFLECTION_MASK_H_
#define VANTAGE_CORE_MODEL_MERGE_REFLECTION_MASK_H_

#include <Eigen/Core>
#include <span>
#include <vector>

#include "core/model/carve/scan_layer.h"

namespace vantage::model {

// Takes out of a layer what it saw through the apertures (model frame), and puts back what an
// earlier call with other apertures took out: the result depends on the scan and on the set of
// apertures alone. Returns the bricks that may have changed.
std::vector<BrickKey> ApplyReflectionMask(std::span<const Aperture> apertures, double voxel_size,
                                          ScanLayer& layer);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_REFLECTION_MASK_H_
