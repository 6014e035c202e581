// Rays into the open sky make space empty and promise nothing (algorithm.md section 4, 'The open
// sky').
#ifndef VANTAGE_CORE_MODEL_CARVE_SKY_RAYS_H_
#define VANTAGE_CORE_MODEL_CARVE_SKY_RAYS_H_

#include <Eigen/Geometry>
#include <cstddef>

#include "core/model/scan/range_surface.h"
#include "core/model/view/model_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

// Ends the rays of a scan's surface that went into the open sky (FindSkyRays) where the scanner,
// which has the scan's native steps, would have seen something, but within the site and not far
// from what was measured. Returns how many.
size_t EndSkyRays(const ModelConfig& config, const sensor::ScannerModel& scanner,
                  const Eigen::Isometry3d& T_model_scan, OpenRangeSurface& surface);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_SKY_RAYS_H_
