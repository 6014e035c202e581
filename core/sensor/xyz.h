// Points from text files: XYZ, PTS, ASC, CSV.
#ifndef VANTAGE_CORE_SENSOR_XYZ_H_
#define VANTAGE_CORE_SENSOR_XYZ_H_

#include "absl/status/status.h"
#include "core/bytes/byte_source.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/point_cloud.h"

namespace vantage::sensor {

// Adds a point for each line: x, y and z come first, and what follows them (intensity, colour) is
// skipped. Columns are set apart by blanks, tabs, commas or semicolons; where there are semicolons,
// a comma is a decimal point. Lines before the first point that are none are skipped (names of
// columns, a number of points), and so are empty lines and those that begin with # or //.
// INVALID_ARGUMENT names the line that is no point. DATA_LOSS: the file cannot be read on.
absl::Status ReadXyz(const bytes::ByteSource& file, const ImportLimits& limits, PointCloud& cloud);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_XYZ_H_
