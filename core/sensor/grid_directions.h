// Points whose grid is not known, or does not fit their directions, to a range image.
#ifndef VANTAGE_CORE_SENSOR_GRID_DIRECTIONS_H_
#define VANTAGE_CORE_SENSOR_GRID_DIRECTIONS_H_

#include <Eigen/Core>
#include <optional>
#include <span>

#include "absl/status/statusor.h"
#include "core/sensor/gridded_scan.h"
#include "core/sensor/range_image.h"

namespace vantage::sensor {

// Rule 2 (gridded_scan.h), else 3 where there are lines that lean, else 4. `leaning`: a range image
// without ranges (KnownGrid::leaning()).
// INVALID_ARGUMENT: fewer than 2 columns or rows, or no return; says what was found.
absl::StatusOr<GriddedScan> GridDirections(std::span<const Eigen::Vector3f> points,
                                           const std::optional<RangeImage>& leaning = {});

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_GRID_DIRECTIONS_H_
