// A scan as the scanner made it: a grid of rays from one centre of projection (algorithm.md
// section 3).
#ifndef VANTAGE_CORE_SENSOR_RANGE_IMAGE_H_
#define VANTAGE_CORE_SENSOR_RANGE_IMAGE_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "core/sensor/appearance.h"

namespace vantage::sensor {

// Columns share an azimuth, rows an elevation; neither need be evenly spaced. Both rise strictly.
// Frame: the scanner's own, right-handed, z up, azimuth counter-clockwise from +x.
struct RangeImage {
  // What a cell holds instead of a range in metres.
  static constexpr float kNoReturn = 0.0f;        // the ray went out and nothing came back
  static constexpr float kNoInformation = -1.0f;  // scanner's body, masked, cropped: as outside
                                                  // the field of view

  std::vector<double> azimuth;    // rad, one per column, strictly rising, spanning less than 2 pi
  std::vector<double> elevation;  // rad, one per row, strictly rising, within [-pi/2, pi/2]
  std::vector<float> range;       // m, column after column, bottom to top: [column * rows + row]
  // As `range`, 0 where there is none; both are empty unless somebody asked for them.
  Appearance appearance;
  bool full_turn = true;  // the last column is followed by the first (azimuth wraps)

  // The steps the instrument measured with, rad; smaller than the grid's when the scan was thinned.
  double native_azimuth_step = 0;
  double native_elevation_step = 0;

  int columns() const { return static_cast<int>(azimuth.size()); }
  int rows() const { return static_cast<int>(elevation.size()); }
  size_t cells() const { return azimuth.size() * elevation.size(); }
  float at(int column, int row) const { return range[Index(column, row)]; }
  size_t Index(int column, int row) const {
    return static_cast<size_t>(column) * elevation.size() + static_cast<size_t>(row);
  }
  static bool IsRange(float value) { return value > 0.0f; }

  // Unit vector of a cell's ray, scanner frame.
  Eigen::Vector3d Direction(int column, int row) const;

  // The number of cells that hold a range.
  size_t SampleCount() const;

  // As Validate(), for everything but the ranges.
  absl::Status ValidateAxes() const;

  // INVALID_ARGUMENT naming what is wrong: empty or unordered axes, ranges or appearance of another
  // size, NaN or infinite values, steps that are not positive, no cell with a range.
  absl::Status Validate() const;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_RANGE_IMAGE_H_
