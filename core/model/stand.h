// Where a scanner stood, it fitted: its blind cone must not ban its own stand (algorithm.md
// section 4).
#ifndef VANTAGE_CORE_MODEL_STAND_H_
#define VANTAGE_CORE_MODEL_STAND_H_

#include "core/model/scan_layer.h"

namespace vantage {

// Finds the floor below the scanner from the layer's own surface, fills in `layer.stand`, empties
// the upright cylinder of the scanner's clearance from the floor to the viewpoint, and lays the
// floor across it. Surface that the scan measured inside the cylinder stays.
void FreeStand(double voxel_size, ScanLayer& layer);

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_STAND_H_
