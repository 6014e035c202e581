// Points from LAS files (ASPRS LAS 1.4 R15; 1.0 to 1.4 are read).
#ifndef VANTAGE_CORE_SENSOR_LAS_H_
#define VANTAGE_CORE_SENSOR_LAS_H_

#include "absl/status/status.h"
#include "core/bytes/byte_source.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/point_cloud.h"

namespace vantage::sensor {

// Adds the points of a file, withdrawn ones left out. Coordinates are taken for metres, whatever
// reference system the file names. INVALID_ARGUMENT: not the format it claims, truncated, or counts
// beyond the limits; the message names the header's field and what to do about it. UNIMPLEMENTED:
// compressed (LAZ), or a newer point format. DATA_LOSS: the file cannot be read on.
absl::Status ReadLas(const bytes::ByteSource& file, const ImportLimits& limits, PointCloud& cloud);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_LAS_H_
