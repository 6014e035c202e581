// Points whose grid is known, to a range image.
#ifndef VANTAGE_CORE_SENSOR_GRID_COLUMNS_H_
#define VANTAGE_CORE_SENSOR_GRID_COLUMNS_H_

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "absl/status/statusor.h"
#include "core/sensor/gridded_scan.h"

namespace vantage::sensor {

// Rule 1 (gridded_scan.h), else 2 or 3 of the returns.
// INVALID_ARGUMENT: fewer than 2 columns or rows, or no return; says what was found.
absl::StatusOr<GriddedScan> GridColumns(std::span<const Eigen::Vector3f> points, size_t columns,
                                        size_t rows);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_GRID_COLUMNS_H_
