// A range image, its scanner, and what is known of its pose.
#ifndef VANTAGE_CORE_SENSOR_SCAN_H_
#define VANTAGE_CORE_SENSOR_SCAN_H_

#include <optional>

#include "core/sensor/pose_prior.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

struct Scan {
  RangeImage image;
  ScannerModel scanner;
  std::optional<PosePrior> prior;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCAN_H_
