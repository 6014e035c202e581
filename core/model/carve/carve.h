// Carving: one scan at one pose to voxels, coarse to fine (algorithm.md section 4, 'How to build it
// fast').
#ifndef VANTAGE_CORE_MODEL_CARVE_CARVE_H_
#define VANTAGE_CORE_MODEL_CARVE_CARVE_H_

#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/model/carve/scan_layer.h"
#include "core/model/view/model_config.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::model {

// Carves one scan at one pose. The image is valid and the pose rigid: the caller has checked. Which
// voxels are empty and which are surface is in algorithm.md section 4, 'Empty space'; the cylinder
// that the scanner stood in is cleared.
std::unique_ptr<ScanLayer> Carve(const sensor::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                                 const ModelConfig& config, parallel::Parallel& parallel);

// The same within a limit of memory, in bytes, which counts what merging the layer takes, too.
// RESOURCE_EXHAUSTED: it would have taken more; that is noticed before it is taken.
absl::StatusOr<std::unique_ptr<ScanLayer>> CarveWithin(int64_t memory_limit,
                                                       const sensor::Scan& scan,
                                                       const Eigen::Isometry3d& T_model_scan,
                                                       const ModelConfig& config,
                                                       parallel::Parallel& parallel);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_CARVE_H_
