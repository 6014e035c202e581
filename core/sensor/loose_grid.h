// The lines (columns and rows) of a grid that is being made from points; see gridded_scan.h for the
// rules.
#ifndef VANTAGE_CORE_SENSOR_LOOSE_GRID_H_
#define VANTAGE_CORE_SENSOR_LOOSE_GRID_H_

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/sensor/gridded_scan.h"

namespace vantage::sensor {

// Columns closer than this share of the median step are one.
inline constexpr double kSameLineShare = 0.05;

// The angle's equal in (-pi, pi].
double WrapAngle(double angle);

double AzimuthOf(const Eigen::Vector3f& point);
double ElevationOf(const Eigen::Vector3f& point);

// Median of (value, weight) pairs, weights positive; `pairs` is left sorted. Not empty.
double WeightedMedian(std::vector<std::pair<double, double>>& pairs);

// Median of the steps between neighbours; `lines` rises and holds at least 2.
double MedianStep(const std::vector<double>& lines);

// Columns and rows in any order and rotation, with cells [column * rows + row].
struct LooseGrid {
  std::vector<double> azimuth;    // rad
  std::vector<double> elevation;  // rad
  std::vector<float> range;
  std::vector<uint32_t> source;  // as GriddedScan's; may be empty
  bool fill_missing_lines = false;
};

// Sorts and merges lines, finds out whether the grid is a full turn and where it begins, and states
// the native steps. Of merged lines the one that comes first in `grid` wins.
absl::StatusOr<GriddedScan> AssembleGrid(LooseGrid grid);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_LOOSE_GRID_H_
