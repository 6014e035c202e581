// Reading what instruments deliver (ptx.h, pcd.h), and encoded range images (encoding.h). The
// result is always a range image in the scanner's own frame, and the pose that the file states, if
// it states one.
#ifndef VANTAGE_CORE_SENSOR_SCAN_FILE_H_
#define VANTAGE_CORE_SENSOR_SCAN_FILE_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// By file name (.ptx, .pcd, .vrim). NOT_FOUND and PERMISSION_DENIED as the file system says.
absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCAN_FILE_H_
