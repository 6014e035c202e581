// Returns to the range image of given lines, along the rays of these.
#ifndef VANTAGE_CORE_SENSOR_RESAMPLING_H_
#define VANTAGE_CORE_SENSOR_RESAMPLING_H_

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "core/sensor/gridded_scan.h"
#include "core/sensor/range_image.h"

namespace vantage::sensor {

// The line nearest to `value`; `rising` is not empty.
size_t Nearest(const std::vector<double>& rising, double value);

// The column nearest to an azimuth (rad), over the cut too; `rising` is not empty.
size_t NearestAround(const std::vector<double>& rising, double azimuth);

// Rules 3 and 4 (gridded_scan.h), once their lines are known. `returns`: m, scanner frame, none at
// the origin. `lines`: a range image without ranges, with two columns and two rows at least.
GriddedScan Resample(std::span<const Eigen::Vector3f> returns, RangeImage lines);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_RESAMPLING_H_
