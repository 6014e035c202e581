// One scan at one pose to voxels, coarse to fine (algorithm.md section 4, 'How to build it fast').
#ifndef VANTAGE_CORE_MODEL_CARVE_CARVE_H_
#define VANTAGE_CORE_MODEL_CARVE_CARVE_H_

#include <memory>

#include "core/model/carve/scan_layer.h"
#include "core/model/view/model_config.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::model {

// The image is valid and the pose rigid: the caller has checked. The rule: a voxel is empty when
// the scan's range in the direction of its centre is farther than the centre; where nothing is
// known in that direction, when most of the rays through the voxel that tell anything pass through
// it (a lone ray that did not come back says nothing about a voxel that a hundred others crossed).
// It is surface when a sample, or a point interpolated between joined samples, lies in it. The
// cylinder that the scanner stood in is empty, and the floor goes on below it.
std::unique_ptr<ScanLayer> Carve(const sensor::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                                 const ModelConfig& config, parallel::Parallel& parallel);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_CARVE_H_
