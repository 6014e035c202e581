// The part of a range image that shows the scanner itself.
#ifndef VANTAGE_CORE_SENSOR_SCANNER_BODY_H_
#define VANTAGE_CORE_SENSOR_SCANNER_BODY_H_

#include "core/sensor/range_image.h"

namespace vantage::sensor {

// The scanner sees itself: returns nearer than `range_min` (m, to the millimetre) become no
// information, and so do no-return cells that are connected to such a cell through no-return cells
// (8 neighbours, azimuth wraps on a full turn) and lie within `blind_zone` (rad) of it.
void MaskScannerBody(double range_min, double blind_zone, RangeImage& image);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCANNER_BODY_H_
