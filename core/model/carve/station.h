// A scanner fitted where it stood, so its blind cone must not ban its own station (algorithm.md
// section 4, 'Where a scanner stood').
#ifndef VANTAGE_CORE_MODEL_CARVE_STATION_H_
#define VANTAGE_CORE_MODEL_CARVE_STATION_H_

#include "core/model/carve/scan_layer.h"

namespace vantage::model {

// Finds the floor below the scanner from the layer's own surface, fills in `layer.station`, empties
// the upright cylinder of the scanner's clearance from the floor to the viewpoint, and lays the
// floor across it. Surface that the scan measured inside the cylinder stays.
void ClearStation(double voxel_size, ScanLayer& layer);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_STATION_H_
