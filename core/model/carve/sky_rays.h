// Rays into the open sky make space empty and promise nothing (algorithm.md section 4, 'The open
// sky').
#ifndef VANTAGE_CORE_MODEL_CARVE_SKY_RAYS_H_
#define VANTAGE_CORE_MODEL_CARVE_SKY_RAYS_H_

#include <cstddef>

#include "core/model/carve/scan_layer.h"
#include "core/model/view/model_config.h"

namespace vantage::model {

// Ends the rays of the layer's range surface that went into the open sky (FindSkyRays) where the
// scanner would have seen something, but within the site and not far from what was measured.
// Returns how many.
size_t EndSkyRays(const ModelConfig& config, ScanLayer& layer);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_SKY_RAYS_H_
