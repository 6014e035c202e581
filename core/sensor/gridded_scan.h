// How points with one known centre of projection become a range image (algorithm.md section 3).
#ifndef VANTAGE_CORE_SENSOR_GRIDDED_SCAN_H_
#define VANTAGE_CORE_SENSOR_GRIDDED_SCAN_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/sensor/range_image.h"

namespace vantage::sensor {

// Points: m, scanner frame, the origin is the centre of projection. A zero vector is a ray with no
// return (only where the grid is known, or it has no direction).
//
// Rule 1, grid known: `points` holds columns x rows entries, column after column. A column's
// azimuth is the median of its points' azimuths weighted by horizontal distance, a row's elevation
// the median of its points' elevations; of lines of more than 1,024 cells, regularly chosen ones
// tell both. Lines without any return lie evenly between their neighbours, or go on by the median
// step at the border (rows beyond the zenith or nadir are dropped). Columns may turn either way and
// rows rise or fall. Applies when 99 % of the returns (of those that tell) lie within half a step
// of their cell's direction; otherwise rules 2 to 4 are applied to the returns.
//
// Rule 2, grid found: sorted azimuths (of points below 80 degrees of elevation) and elevations fall
// into clusters whose gaps are at least 10 times the gaps inside them; clusters are the columns and
// rows, and at least a quarter of the cells has a point. Where three quarters of the steps are
// within a tenth of the median step, a gap of a whole number of steps is filled with lines of no
// return (as many as were found, at most).
//
// Rule 3, grid known, its lines lean (an instrument that stands askew in the file's frame, axes
// that are not square, a centre of projection that is a centimetre off): the lines of rule 1,
// whatever returns lie beside them, and more at their ends where points lie beyond. Applies when at
// most a tenth of the returns share a cell.
//
// Rule 4, no grid (an irregular instrument): even lines whose step is 1.25 times the mean spacing
// of the directions.
//
// Rules 3 and 4: a cell holds the range, along the cell's own direction, of the plane through the
// points in it and the cells around it where they agree to 1 cm + 1 % of the range, else of the
// point nearest to its direction. An empty cell between two that hold a range (left and right, or
// above and below) is no information, since only the resampling left it out.
//
// Rules 1 and 2: where several returns fall into one cell the first stored wins, a return wins over
// none, and columns closer than a twentieth of the median step are one (a scanner that turned a
// little further than once). All rules: the image is a full turn when no gap between columns
// exceeds 3 median steps, and then begins at the first column after -180 degrees; otherwise it
// begins after the widest gap. The native steps are the median steps (rule 4: the mean spacing).
struct GriddedScan {
  RangeImage image;
  // By cell: the number of the point that its range is from, in the order in which points were
  // given, or kNoSource. Empty where nobody asked.
  static constexpr uint32_t kNoSource = ~uint32_t{0};
  std::vector<uint32_t> source;
  size_t duplicates = 0;   // returns whose cell an earlier one had taken
  bool resampled = false;  // the directions formed no grid: cells are interpolated (rules 3 and 4)
  bool leaning = false;    // by rule 3
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_GRIDDED_SCAN_H_
