#include "core/sensor/loose_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

double WrapAngle(double angle) {
  const double wrapped = std::remainder(angle, 2 * kPi);
  return wrapped <= -kPi ? wrapped + 2 * kPi : wrapped;
}

double AzimuthOf(const Eigen::Vector3f& point) {
  return WrapAngle(std::atan2(static_cast<double>(point.y()), static_cast<double>(point.x())));
}

double ElevationOf(const Eigen::Vector3f& point) {
  const Eigen::Vector3d p = point.cast<double>();
  return std::atan2(p.z(), std::hypot(p.x(), p.y()));
}

double WeightedMedian(std::vector<std::pair<double, double>>& pairs) {
  std::sort(pairs.begin(), pairs.end());
  double total = 0;
  for (const auto& [value, weight] : pairs) total += weight;
  double sum = 0;
  for (const auto& [value, weight] : pairs) {
    sum += weight;
    if (2 * sum >= total) return value;
  }
  return pairs.back().first;
}

double MedianStep(const std::vector<double>& lines) {
  std::vector<double> steps(lines.size() - 1);
  for (size_t i = 0; i < steps.size(); ++i) steps[i] = lines[i + 1] - lines[i];
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

namespace {

// A line of the finished grid: its angle, and the loose lines that it is made of, the first one
// first.
struct Line {
  double angle = 0;
  std::vector<size_t> sources;  // none: a line that was filled in
};

std::vector<Line> SortAndMerge(const std::vector<double>& angles) {
  std::vector<size_t> order(angles.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return angles[a] < angles[b]; });
  std::vector<double> sorted(angles.size());
  for (size_t i = 0; i < order.size(); ++i) sorted[i] = angles[order[i]];
  const double same = sorted.size() < 2 ? 0 : kSameLineShare * MedianStep(sorted);
  std::vector<Line> lines;
  for (const size_t source : order) {
    if (lines.empty() || angles[source] - lines.back().angle > same) {
      lines.push_back({angles[source], {}});
    }
    lines.back().sources.push_back(source);
  }
  for (Line& line : lines) {
    std::sort(line.sources.begin(), line.sources.end());
    line.angle = angles[line.sources.front()];
  }
  return lines;
}

double MedianStepOf(const std::vector<Line>& lines) {
  std::vector<double> angles;
  angles.reserve(lines.size());
  for (const Line& line : lines) angles.push_back(line.angle);
  return MedianStep(angles);
}

// Rotates the columns so that they begin where the image begins. Returns whether it is a full turn.
bool RotateToBeginning(std::vector<Line>& columns) {
  const double step = MedianStepOf(columns);
  double widest = columns.front().angle + 2 * kPi - columns.back().angle;
  // The last and the first column may be the same direction, a little more than a turn apart.
  if (widest <= kSameLineShare * step && columns.size() > 2) {
    Line& first = columns.front();
    first.sources.insert(first.sources.end(), columns.back().sources.begin(),
                         columns.back().sources.end());
    std::sort(first.sources.begin(), first.sources.end());
    columns.pop_back();
    widest = columns.front().angle + 2 * kPi - columns.back().angle;
  }
  size_t begin = 0;
  for (size_t i = 1; i < columns.size(); ++i) {
    const double gap = columns[i].angle - columns[i - 1].angle;
    if (gap > widest) {
      widest = gap;
      begin = i;
    }
  }
  if (widest <= 3 * step) return true;
  for (size_t i = 0; i < begin; ++i) columns[i].angle += 2 * kPi;
  std::rotate(columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(begin), columns.end());
  return false;
}

// Whether three quarters of the steps are within a tenth of the median step.
bool IsEven(const std::vector<Line>& lines, double step) {
  size_t even = 0;
  for (size_t i = 1; i < lines.size(); ++i) {
    even += std::abs(lines[i].angle - lines[i - 1].angle - step) <= 0.1 * step ? 1 : 0;
  }
  return 4 * even >= 3 * (lines.size() - 1);
}

// Lines of no return where a gap is a whole number of steps; at most as many as there are lines, so
// that odd directions cannot make a huge grid.
void FillMissing(double end, std::vector<Line>& lines) {
  const double step = MedianStepOf(lines);
  if (!IsEven(lines, step)) return;
  std::vector<Line> filled;
  auto spare = static_cast<double>(lines.size());
  for (size_t i = 0; i < lines.size(); ++i) {
    const double next = i + 1 < lines.size() ? lines[i + 1].angle : end;
    filled.push_back(std::move(lines[i]));
    const double gap = next - filled.back().angle;
    const double count = std::round(gap / step);
    if (!(count >= 2 && std::abs(gap - count * step) < 0.25 * step)) continue;
    if (count - 1 > spare) continue;
    spare -= count - 1;
    const double from = filled.back().angle;
    for (double k = 1; k < count; ++k) filled.push_back({from + gap * k / count, {}});
  }
  lines = std::move(filled);
}

// Where lines are as they were, but that another column comes first: which. Then cells stay
// together, and a large grid needs no second copy.
std::optional<size_t> TurnedOnly(const std::vector<Line>& columns, const std::vector<Line>& rows,
                                 const LooseGrid& grid) {
  if (columns.size() != grid.azimuth.size() || rows.size() != grid.elevation.size()) {
    return std::nullopt;
  }
  const auto is = [](const Line& line, size_t source) {
    return line.sources.size() == 1 && line.sources.front() == source;
  };
  for (size_t i = 0; i < rows.size(); ++i) {
    if (!is(rows[i], i)) return std::nullopt;
  }
  if (columns.front().sources.size() != 1) return std::nullopt;
  const size_t first = columns.front().sources.front();
  for (size_t i = 0; i < columns.size(); ++i) {
    if (!is(columns[i], (first + i) % columns.size())) return std::nullopt;
  }
  return first;
}

}  // namespace

absl::StatusOr<GriddedScan> AssembleGrid(LooseGrid grid) {
  std::vector<Line> columns = SortAndMerge(grid.azimuth);
  std::vector<Line> rows = SortAndMerge(grid.elevation);
  if (columns.size() < 2 || rows.size() < 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: their directions make ", columns.size(), " columns x ", rows.size(),
                     " rows; at least 2 x 2 are needed for a scan from one centre of projection"));
  }
  GriddedScan result;
  RangeImage& image = result.image;
  image.full_turn = RotateToBeginning(columns);
  image.native_azimuth_step = MedianStepOf(columns);
  image.native_elevation_step = MedianStepOf(rows);
  if (grid.fill_missing_lines) {
    const double end = image.full_turn ? columns.front().angle + 2 * kPi : columns.back().angle;
    FillMissing(end, columns);
    FillMissing(rows.back().angle, rows);
  }
  for (const Line& column : columns) image.azimuth.push_back(column.angle);
  for (const Line& row : rows) image.elevation.push_back(std::clamp(row.angle, -kPi / 2, kPi / 2));
  if (const std::optional<size_t> turn = TurnedOnly(columns, rows, grid)) {
    const auto first = static_cast<std::ptrdiff_t>(*turn * rows.size());
    std::rotate(grid.range.begin(), grid.range.begin() + first, grid.range.end());
    image.range = std::move(grid.range);
    if (!grid.source.empty()) {
      std::rotate(grid.source.begin(), grid.source.begin() + first, grid.source.end());
      result.source = std::move(grid.source);
    }
    if (absl::Status valid = image.Validate(); !valid.ok()) return valid;
    return result;
  }
  image.range.reserve(columns.size() * rows.size());
  const size_t stride = grid.elevation.size();
  for (const Line& column : columns) {
    for (const Line& row : rows) {
      float cell = RangeImage::kNoReturn;
      uint32_t source = GriddedScan::kNoSource;
      for (const size_t c : column.sources) {
        for (const size_t r : row.sources) {
          const float value = grid.range[c * stride + r];
          if (!RangeImage::IsRange(value)) {
            if (cell == RangeImage::kNoReturn) cell = value;
            continue;
          }
          if (RangeImage::IsRange(cell)) {
            ++result.duplicates;
          } else {
            cell = value;
            if (!grid.source.empty()) source = grid.source[c * stride + r];
          }
        }
      }
      image.range.push_back(cell);
      if (!grid.source.empty()) result.source.push_back(source);
    }
  }
  if (absl::Status valid = image.Validate(); !valid.ok()) return valid;
  return result;
}

}  // namespace vantage::sensor
