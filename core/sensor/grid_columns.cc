#include "core/sensor/grid_columns.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/sensor/grid_directions.h"
#include "core/sensor/loose_grid.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {
namespace {

// Points as a grid, column after column or row after row.
struct KnownGrid {
  std::span<const Eigen::Vector3f> points;
  size_t columns;
  size_t rows;
  size_t column_stride;
  size_t row_stride;

  const Eigen::Vector3f& at(size_t column, size_t row) const {
    return points[column * column_stride + row * row_stride];
  }
};

bool IsReturn(const Eigen::Vector3f& point) { return !point.isZero(0); }

std::optional<double> ColumnAzimuth(const KnownGrid& grid, size_t column) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (size_t row = 0; row < grid.rows; ++row) {
    sum += grid.at(column, row).head<2>().cast<double>();
  }
  if (sum.isZero(0)) return std::nullopt;
  const double about = std::atan2(sum.y(), sum.x());
  std::vector<std::pair<double, double>> azimuths;
  for (size_t row = 0; row < grid.rows; ++row) {
    const Eigen::Vector3f& p = grid.at(column, row);
    const double weight = std::hypot(p.x(), p.y());
    if (weight > 0) azimuths.emplace_back(WrapAngle(AzimuthOf(p) - about), weight);
  }
  return about + WeightedMedian(azimuths);
}

std::optional<double> RowElevation(const KnownGrid& grid, size_t row) {
  std::vector<std::pair<double, double>> elevations;
  for (size_t column = 0; column < grid.columns; ++column) {
    const Eigen::Vector3f& p = grid.at(column, row);
    if (IsReturn(p)) elevations.emplace_back(ElevationOf(p), p.norm());
  }
  if (elevations.empty()) return std::nullopt;
  return WeightedMedian(elevations);
}

// Gives lines without a return their place. `wraps`: angles are azimuths. False when fewer than two
// lines are known.
bool CompleteLines(const std::vector<std::optional<double>>& known, bool wraps,
                   std::vector<double>& lines) {
  const auto difference = [wraps](double to, double from) {
    return wraps ? WrapAngle(to - from) : to - from;
  };
  std::vector<size_t> at;
  for (size_t i = 0; i < known.size(); ++i) {
    if (known[i].has_value()) at.push_back(i);
  }
  if (at.size() < 2) return false;
  std::vector<double> steps;
  for (size_t k = 1; k < at.size(); ++k) {
    steps.push_back(difference(*known[at[k]], *known[at[k - 1]]) /
                    static_cast<double>(at[k] - at[k - 1]));
  }
  std::vector<double> by_size = steps;
  std::sort(by_size.begin(), by_size.end());
  const double step = by_size[by_size.size() / 2];
  lines.resize(known.size());
  size_t before = 0;  // index into `at` of the last known line at or before i
  for (size_t i = 0; i < known.size(); ++i) {
    while (before + 1 < at.size() && at[before + 1] <= i) ++before;
    const double base = *known[at[before]];
    const double offset = static_cast<double>(i) - static_cast<double>(at[before]);
    const bool inside = i >= at[before] && before + 1 < at.size();
    lines[i] = base + offset * (inside ? steps[before] : step);
  }
  return true;
}

// Rule 1, or nothing when the directions do not agree with the grid.
std::optional<LooseGrid> FitAxes(const KnownGrid& grid) {
  std::vector<std::optional<double>> columns(grid.columns);
  std::vector<std::optional<double>> rows(grid.rows);
  for (size_t i = 0; i < grid.columns; ++i) columns[i] = ColumnAzimuth(grid, i);
  for (size_t i = 0; i < grid.rows; ++i) rows[i] = RowElevation(grid, i);
  LooseGrid loose;
  if (!CompleteLines(columns, true, loose.azimuth)) return std::nullopt;
  if (!CompleteLines(rows, false, loose.elevation)) return std::nullopt;
  std::vector<double> sorted = loose.azimuth;
  for (double& azimuth : sorted) azimuth = WrapAngle(azimuth);
  loose.azimuth = sorted;
  std::sort(sorted.begin(), sorted.end());
  const double half_column = 0.5 * MedianStep(sorted);
  sorted = loose.elevation;
  std::sort(sorted.begin(), sorted.end());
  const double half_row = 0.5 * MedianStep(sorted);
  size_t returns = 0;
  size_t agreeing = 0;
  loose.range.assign(grid.columns * grid.rows, RangeImage::kNoReturn);
  for (size_t column = 0; column < grid.columns; ++column) {
    for (size_t row = 0; row < grid.rows; ++row) {
      const Eigen::Vector3f& p = grid.at(column, row);
      if (!IsReturn(p)) continue;
      ++returns;
      const double elevation = ElevationOf(p);
      const double across =
          std::cos(elevation) * std::abs(WrapAngle(AzimuthOf(p) - loose.azimuth[column]));
      const double along = std::abs(elevation - loose.elevation[row]);
      agreeing += across <= half_column && along <= half_row ? 1 : 0;
      loose.range[column * grid.rows + row] = p.norm();
    }
  }
  if (100 * agreeing < 99 * returns) return std::nullopt;
  // Rows of no return that would lie beyond the zenith or nadir.
  std::vector<double> elevation;
  std::vector<size_t> kept;
  for (size_t row = 0; row < grid.rows; ++row) {
    if (std::abs(loose.elevation[row]) > kPi / 2 && !rows[row].has_value()) continue;
    kept.push_back(row);
    elevation.push_back(loose.elevation[row]);
  }
  if (kept.size() < grid.rows) {
    std::vector<float> range;
    range.reserve(grid.columns * kept.size());
    for (size_t column = 0; column < grid.columns; ++column) {
      for (const size_t row : kept) range.push_back(loose.range[column * grid.rows + row]);
    }
    loose.range = std::move(range);
    loose.elevation = std::move(elevation);
  }
  return loose;
}

}  // namespace

absl::StatusOr<GriddedScan> GridColumns(std::span<const Eigen::Vector3f> points, size_t columns,
                                        size_t rows) {
  if (columns < 2 || rows < 2 || points.size() != columns * rows) {
    return absl::InvalidArgumentError(absl::StrCat("grid: ", points.size(), " points for ", columns,
                                                   " columns x ", rows,
                                                   " rows; at least 2 x 2 are needed"));
  }
  if (std::none_of(points.begin(), points.end(), IsReturn)) {
    return absl::InvalidArgumentError(
        "points: no ray of the scan returned anything; there is nothing to model");
  }
  for (const KnownGrid& grid :
       {KnownGrid{points, columns, rows, rows, 1}, KnownGrid{points, rows, columns, 1, rows}}) {
    if (std::optional<LooseGrid> loose = FitAxes(grid); loose.has_value()) {
      return AssembleGrid(*std::move(loose));
    }
  }
  return GridDirections(points);
}

}  // namespace vantage::sensor
