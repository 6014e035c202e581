// What a layer keeps of its scan's range image once its voxels are carved.
#ifndef VANTAGE_CORE_MODEL_CARVE_THIN_LAYER_H_
#define VANTAGE_CORE_MODEL_CARVE_THIN_LAYER_H_

#include <cstddef>

#include "core/model/carve/scan_layer.h"
#include "core/parallel/parallel.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::model {

// Rays are left out as long as the others are no farther apart than this, rad: merging asks a layer
// why a voxel is unknown and what it saw of other scans' mirrors, and previews, whose rays are 0.25
// to 0.32 degrees apart, answer as well. From 9 m on a voxel of 5 cm is smaller than that; its
// answer is then that of the ray beside it.
inline constexpr double kLayerStep = sensor::Radians(0.32);

// Cells that a layer keeps of an image: those of a scan with about that step at most, however dense
// it is.
size_t KeptCells(const sensor::RangeImage& image);

// Leaves out rays of the range surface, so that its memory does not depend on how dense the scan
// was. After carving, which looks at all of them.
void ThinLayer(parallel::Parallel& parallel, ScanLayer& layer);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_THIN_LAYER_H_
