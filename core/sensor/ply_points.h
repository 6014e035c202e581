// Points from PLY files.
#ifndef VANTAGE_CORE_SENSOR_PLY_POINTS_H_
#define VANTAGE_CORE_SENSOR_PLY_POINTS_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/point_cloud.h"

namespace vantage::sensor {

// Adds the vertices of a file, ascii or binary little-endian; other elements are skipped.
// INVALID_ARGUMENT: not the format it claims, truncated, or counts beyond the limits; the message
// names element and instance. UNIMPLEMENTED: big-endian.
absl::Status ReadPlyPoints(absl::string_view bytes, const ImportLimits& limits, PointCloud& cloud);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_PLY_POINTS_H_
