// What looks wrong with a scan that was read without an error: units, frames, lost shapes.
#ifndef VANTAGE_CORE_SENSOR_ODDITIES_H_
#define VANTAGE_CORE_SENSOR_ODDITIES_H_

#include <string>
#include <vector>

#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// In words for the person who has the file, each with what helps. None for most scans; a scan that
// has some may be right all the same.
//
// - Units: floor and ceiling lie as far from the scanner as they do under a tripod in a room, if
//   the file's unit were feet, inches or centimetres; in metres, farther than under any tripod.
// - Frame: all was seen in a cone about the vertical, as by a depth camera, whose z points ahead.
// - Shape: rows and columns of a grid are no rows and columns of directions, so it was
// interpolated.
std::vector<std::string> Oddities(const ImportedScan& scan);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_ODDITIES_H_
