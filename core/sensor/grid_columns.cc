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

// Points of a line by which its angle is found, at most: their median is as good as that of all.
constexpr size_t kKept = 1024;

// Share of the returns that lie within half a step of their cell's direction where a grid is what
// it says it is.
constexpr double kAgreeing = 0.99;

bool IsReturn(const Eigen::Vector3f& point) { return !point.isZero(0); }

size_t StrideOf(size_t cells) { return (cells + kKept - 1) / kKept; }
size_t KeptOf(size_t cells) { return (cells + StrideOf(cells) - 1) / StrideOf(cells); }

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

// Points of a column, or of a row: those of every so many cells, zero where none was put.
struct KeptLine {
  const Eigen::Vector3f* first = nullptr;
  size_t count = 0;
  size_t step = 1;  // from one point to the next

  const Eigen::Vector3f& point(size_t i) const { return first[i * step]; }
};

// One way to read the grid: as it was put, or with its columns for rows.
struct Reading {
  std::vector<KeptLine> columns;
  std::vector<KeptLine> rows;
  size_t row_stride = 1;      // of the rows whose points columns keep
  bool columns_first = true;  // ranges are [column * rows + row], else [row * columns + column]
};

std::optional<double> ColumnAzimuth(const KeptLine& column) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (size_t i = 0; i < column.count; ++i) {
    sum += column.point(i).head<2>().cast<double>();
  }
  if (sum.isZero(0)) return std::nullopt;
  const double about = std::atan2(sum.y(), sum.x());
  std::vector<std::pair<double, double>> azimuths;
  for (size_t i = 0; i < column.count; ++i) {
    const Eigen::Vector3f& p = column.point(i);
    const double weight = std::hypot(p.x(), p.y());
    if (weight > 0) azimuths.emplace_back(WrapAngle(AzimuthOf(p) - about), weight);
  }
  return about + WeightedMedian(azimuths);
}

std::optional<double> RowElevation(const KeptLine& row) {
  std::vector<std::pair<double, double>> elevations;
  for (size_t i = 0; i < row.count; ++i) {
    const Eigen::Vector3f& p = row.point(i);
    if (IsReturn(p)) elevations.emplace_back(ElevationOf(p), p.norm());
  }
  if (elevations.empty()) return std::nullopt;
  return WeightedMedian(elevations);
}

// Half the median step between lines in any order.
double HalfStep(std::vector<double> lines) {
  std::sort(lines.begin(), lines.end());
  return 0.5 * MedianStep(lines);
}

// Without the rows of no return that would lie beyond the zenith or nadir. `known`: rows that have
// a return.
void DropRowsBeyondThePoles(const std::vector<std::optional<double>>& known, LooseGrid& loose) {
  const size_t rows = loose.elevation.size();
  std::vector<double> elevation;
  std::vector<size_t> kept;
  for (size_t row = 0; row < rows; ++row) {
    if (std::abs(loose.elevation[row]) > kPi / 2 && !known[row].has_value()) continue;
    kept.push_back(row);
    elevation.push_back(loose.elevation[row]);
  }
  if (kept.size() == rows) return;
  std::vector<float> range;
  std::vector<uint32_t> source;
  range.reserve(loose.azimuth.size() * kept.size());
  for (size_t column = 0; column < loose.azimuth.size(); ++column) {
    for (const size_t row : kept) {
      range.push_back(loose.range[column * rows + row]);
      if (!loose.source.empty()) source.push_back(loose.source[column * rows + row]);
    }
  }
  loose.range = std::move(range);
  loose.source = std::move(source);
  loose.elevation = std::move(elevation);
}

// The lines of a reading of the grid, without ranges.
struct FittedAxes {
  LooseGrid loose;
  std::vector<std::optional<double>> rows;  // those that have a return
  double agreeing = 0;  // share of the returns within half a step of their cell's direction
};

// Nothing when fewer than two columns or two rows have a return.
std::optional<FittedAxes> FitAxes(const Reading& grid) {
  FittedAxes fitted;
  LooseGrid& loose = fitted.loose;
  std::vector<std::optional<double>>& rows = fitted.rows;
  std::vector<std::optional<double>> columns(grid.columns.size());
  rows.resize(grid.rows.size());
  for (size_t i = 0; i < columns.size(); ++i) columns[i] = ColumnAzimuth(grid.columns[i]);
  for (size_t i = 0; i < rows.size(); ++i) rows[i] = RowElevation(grid.rows[i]);
  if (!CompleteLines(columns, true, loose.azimuth)) return std::nullopt;
  if (!CompleteLines(rows, false, loose.elevation)) return std::nullopt;
  for (double& azimuth : loose.azimuth) azimuth = WrapAngle(azimuth);
  const double half_column = HalfStep(loose.azimuth);
  const double half_row = HalfStep(loose.elevation);
  size_t returns = 0;
  size_t agreeing = 0;
  for (size_t column = 0; column < columns.size(); ++column) {
    const KeptLine& line = grid.columns[column];
    for (size_t i = 0; i < line.count; ++i) {
      const Eigen::Vector3f& p = line.point(i);
      if (!IsReturn(p)) continue;
      ++returns;
      const double elevation = ElevationOf(p);
      const double across =
          std::cos(elevation) * std::abs(WrapAngle(AzimuthOf(p) - loose.azimuth[column]));
      const double along = std::abs(elevation - loose.elevation[i * grid.row_stride]);
      agreeing += across <= half_column && along <= half_row ? 1 : 0;
    }
  }
  fitted.agreeing = static_cast<double>(agreeing) / static_cast<double>(returns);
  return fitted;
}

// [a * n + b] to [b * m + a], of m times n.
template <typename Value>
std::vector<Value> Transposed(const std::vector<Value>& values, size_t m, size_t n) {
  std::vector<Value> transposed(values.size());
  if (values.empty()) return transposed;
  for (size_t a = 0; a < m; ++a) {
    for (size_t b = 0; b < n; ++b) transposed[b * m + a] = values[a * n + b];
  }
  return transposed;
}

}  // namespace

KnownGrid::KnownGrid(size_t columns, size_t rows, bool sources)
    : columns_(columns),
      rows_(rows),
      column_stride_(StrideOf(columns)),
      row_stride_(StrideOf(rows)),
      kept_rows_(KeptOf(rows)),
      kept_columns_(KeptOf(columns)),
      range_(columns * rows, RangeImage::kNoReturn),
      in_columns_(columns * kept_rows_, Eigen::Vector3f::Zero()) {
  if (sources) source_.assign(columns * rows, GriddedScan::kNoSource);
  if (row_stride_ > 1) in_rows_.assign(rows * kept_columns_, Eigen::Vector3f::Zero());
}

bool KnownGrid::Put(size_t column, size_t row, const Eigen::Vector3f& point, uint32_t number) {
  float& range = range_[column * rows_ + row];
  if (RangeImage::IsRange(range)) return false;
  range = point.norm();
  if (!source_.empty()) source_[column * rows_ + row] = number;
  ++returns_;
  if (row % row_stride_ == 0) in_columns_[column * kept_rows_ + row / row_stride_] = point;
  if (!in_rows_.empty() && column % column_stride_ == 0) {
    in_rows_[row * kept_columns_ + column / column_stride_] = point;
  }
  return true;
}

std::optional<absl::StatusOr<GriddedScan>> KnownGrid::ToScan() {
  if (empty()) return std::nullopt;
  Reading as_put;
  for (size_t column = 0; column < columns_; ++column) {
    as_put.columns.push_back({&in_columns_[column * kept_rows_], kept_rows_, 1});
  }
  for (size_t row = 0; row < rows_; ++row) {
    as_put.rows.push_back(
        in_rows_.empty() ? KeptLine{&in_columns_[row], kept_columns_, column_stride_ * kept_rows_}
                         : KeptLine{&in_rows_[row * kept_columns_], kept_columns_, 1});
  }
  as_put.row_stride = row_stride_;
  const Reading turned{as_put.rows, as_put.columns, column_stride_, false};
  std::optional<FittedAxes> best;
  bool columns_first = true;
  for (const Reading& reading : {as_put, turned}) {
    std::optional<FittedAxes> fitted = FitAxes(reading);
    if (!fitted.has_value()) continue;
    if (best.has_value() && best->agreeing >= fitted->agreeing) continue;
    columns_first = reading.columns_first;
    best = std::move(fitted);
    if (best->agreeing >= kAgreeing) break;
  }
  in_columns_ = {};
  in_rows_ = {};
  if (!best.has_value()) return std::nullopt;
  best->loose.range = columns_first ? std::move(range_) : Transposed(range_, columns_, rows_);
  range_ = {};
  best->loose.source = columns_first ? std::move(source_) : Transposed(source_, columns_, rows_);
  source_ = {};
  DropRowsBeyondThePoles(best->rows, best->loose);
  absl::StatusOr<GriddedScan> scan = AssembleGrid(std::move(best->loose));
  if (best->agreeing >= kAgreeing) return scan;
  if (scan.ok()) {
    leaning_ = std::move(scan->image);
    leaning_->range = {};
  }
  return std::nullopt;
}

absl::StatusOr<GriddedScan> GridColumns(std::span<const Eigen::Vector3f> points, size_t columns,
                                        size_t rows) {
  if (columns < 2 || rows < 2 || points.size() != columns * rows) {
    return absl::InvalidArgumentError(absl::StrCat("grid: ", points.size(), " points for ", columns,
                                                   " columns x ", rows,
                                                   " rows; at least 2 x 2 are needed"));
  }
  KnownGrid grid(columns, rows, true);
  for (size_t column = 0; column < columns; ++column) {
    for (size_t row = 0; row < rows; ++row) {
      const size_t number = column * rows + row;
      const Eigen::Vector3f& point = points[number];
      if (IsReturn(point)) grid.Put(column, row, point, static_cast<uint32_t>(number));
    }
  }
  if (grid.empty()) {
    return absl::InvalidArgumentError(
        "points: no ray of the scan returned anything; there is nothing to model");
  }
  if (auto scan = grid.ToScan(); scan.has_value()) return *std::move(scan);
  return GridDirections(points, grid.leaning());
}

}  // namespace vantage::sensor
