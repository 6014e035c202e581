// Points whose grid is known, to a range image.
#ifndef VANTAGE_CORE_SENSOR_GRID_COLUMNS_H_
#define VANTAGE_CORE_SENSOR_GRID_COLUMNS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/sensor/gridded_scan.h"
#include "core/sensor/range_image.h"

namespace vantage::sensor {

// A grid that is filled point by point, in any order. Of each point it keeps the range, and of a
// thousand in each line the direction too: a grid of 40 million cells takes 0.35 GB.
class KnownGrid {
 public:
  // `sources`: whether the scan is to say which return each range is from.
  KnownGrid(size_t columns, size_t rows, bool sources);

  // A return, and its number. False where the cell has one: the first counts.
  bool Put(size_t column, size_t row, const Eigen::Vector3f& point, uint32_t number);
  bool empty() const { return returns_ == 0; }

  // Rule 1 (gridded_scan.h); nothing where it does not apply, or no return was put. Once: the grid
  // is used up.
  std::optional<absl::StatusOr<GriddedScan>> ToScan();
  // After that gave nothing: the lines of rule 3, as a range image without ranges, if there are
  // any.
  const std::optional<RangeImage>& leaning() const { return leaning_; }

 private:
  size_t columns_;
  size_t rows_;
  size_t column_stride_;  // of the columns whose points rows keep
  size_t row_stride_;     // of the rows whose points columns keep
  size_t kept_rows_;      // points that a column keeps
  size_t kept_columns_;   // points that a row keeps
  size_t returns_ = 0;
  std::vector<float> range_;                 // [column * rows + row]
  std::vector<uint32_t> source_;             // likewise; empty where nobody asked
  std::vector<Eigen::Vector3f> in_columns_;  // [column * kept_rows + row / row_stride]
  // [row * kept_columns + column / column_stride]; none where columns keep all.
  std::vector<Eigen::Vector3f> in_rows_;
  std::optional<RangeImage> leaning_;
};

// Rule 1 (gridded_scan.h), else 2 to 4 of the returns.
// INVALID_ARGUMENT: fewer than 2 columns or rows, or no return; says what was found.
absl::StatusOr<GriddedScan> GridColumns(std::span<const Eigen::Vector3f> points, size_t columns,
                                        size_t rows);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_GRID_COLUMNS_H_
