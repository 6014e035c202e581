#include "core/sensor/grid_directions.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/sensor/loose_grid.h"
#include "core/sensor/resampling.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {
namespace {

constexpr double kWellConditioned = Radians(80);  // elevations whose azimuth can be trusted
constexpr double kFinestGap = 2e-6;               // rad; what is closer is the same direction
constexpr double kClusterRatio = 10;              // gaps between clusters over gaps inside
// Of the returns, that may share a cell where lines lean: neighbours lean alike, so that few do. Of
// directions that have nothing to do with their place in the grid a third would, and more.
constexpr double kLostToLeaning = 0.1;

// Begins after the widest gap of the circle, so that no cluster is cut; ascending.
std::vector<double> UnrollAtWidestGap(std::vector<double> azimuths) {
  std::sort(azimuths.begin(), azimuths.end());
  double widest = azimuths.front() + 2 * kPi - azimuths.back();
  size_t begin = 0;
  for (size_t i = 1; i < azimuths.size(); ++i) {
    if (azimuths[i] - azimuths[i - 1] > widest) {
      widest = azimuths[i] - azimuths[i - 1];
      begin = i;
    }
  }
  for (size_t i = 0; i < begin; ++i) azimuths[i] += 2 * kPi;
  std::rotate(azimuths.begin(), azimuths.begin() + static_cast<std::ptrdiff_t>(begin),
              azimuths.end());
  return azimuths;
}

// The middles of the clusters that sorted values fall into; empty when there are no clear ones.
std::vector<double> ClusterMiddles(const std::vector<double>& sorted) {
  if (sorted.size() < 4) return {};
  std::vector<double> gaps(sorted.size() - 1);
  for (size_t i = 0; i < gaps.size(); ++i) gaps[i] = sorted[i + 1] - sorted[i];
  std::vector<double> by_size = gaps;
  std::sort(by_size.begin(), by_size.end(), std::greater<>());
  double best_ratio = 0;
  double threshold = 0;
  for (size_t k = 1; k < by_size.size() && k <= sorted.size() / 2; ++k) {
    if (by_size[k - 1] <= kFinestGap) break;
    const double inside = std::max(by_size[k], kFinestGap);
    if (by_size[k - 1] / inside > best_ratio) {
      best_ratio = by_size[k - 1] / inside;
      threshold = std::sqrt(by_size[k - 1] * inside);
    }
  }
  if (best_ratio < kClusterRatio) return {};
  std::vector<double> middles;
  size_t begin = 0;
  for (size_t i = 0; i < sorted.size(); ++i) {
    if (i + 1 < sorted.size() && gaps[i] <= threshold) continue;
    middles.push_back(sorted[begin + (i - begin) / 2]);
    begin = i + 1;
  }
  return middles;
}

// Clusters closer than the share of the median step that makes lines one, the first one kept.
std::vector<double> MergeClose(const std::vector<double>& middles) {
  if (middles.size() < 2) return middles;
  const double same = kSameLineShare * MedianStep(middles);
  std::vector<double> merged;
  for (const double middle : middles) {
    if (merged.empty() || middle - merged.back() > same) merged.push_back(middle);
  }
  return merged;
}

// With more lines at both ends, as far as points lie beyond: half the grid's extent at most.
RangeImage WithLinesFor(RangeImage lines, const std::vector<double>& azimuths,
                        const std::vector<double>& elevations) {
  const auto extend = [](std::vector<double>& axis, double step, double low, double high) {
    const size_t most = axis.size() / 4;
    std::vector<double> before;
    while (before.size() < most) {
      const double next = axis.front() - static_cast<double>(before.size() + 1) * step;
      if (low > next + 0.5 * step) break;
      before.push_back(next);
    }
    std::reverse(before.begin(), before.end());
    const double last = axis.back();
    for (size_t i = 1; i <= most && high > last + (static_cast<double>(i) - 0.5) * step; ++i) {
      axis.push_back(last + static_cast<double>(i) * step);
    }
    axis.insert(axis.begin(), before.begin(), before.end());
  };
  const auto [low, high] = std::minmax_element(elevations.begin(), elevations.end());
  extend(lines.elevation, lines.native_elevation_step, *low, *high);
  std::erase_if(lines.elevation, [](double elevation) { return std::abs(elevation) > kPi / 2; });
  if (lines.full_turn) return lines;
  const double middle = 0.5 * (lines.azimuth.front() + lines.azimuth.back());
  double first = lines.azimuth.front();
  double last = lines.azimuth.back();
  for (const double azimuth : azimuths) {
    const double unrolled = middle + WrapAngle(azimuth - middle);
    first = std::min(first, unrolled);
    last = std::max(last, unrolled);
  }
  extend(lines.azimuth, lines.native_azimuth_step, first, last);
  // A line on the other side of the circle may be one of these again.
  while (lines.azimuth.back() - lines.azimuth.front() >= 2 * kPi) lines.azimuth.pop_back();
  return lines;
}

// Rule 2; nothing when the points show no grid.
std::optional<absl::StatusOr<GriddedScan>> FindGrid(std::span<const Eigen::Vector3f> points,
                                                    const std::vector<double>& azimuths,
                                                    const std::vector<double>& elevations) {
  std::vector<double> sorted;
  for (size_t i = 0; i < points.size(); ++i) {
    if (std::abs(elevations[i]) < kWellConditioned) sorted.push_back(azimuths[i]);
  }
  if (sorted.size() < 4) return std::nullopt;
  const std::vector<double> columns = MergeClose(ClusterMiddles(UnrollAtWidestGap(sorted)));
  sorted = elevations;
  std::sort(sorted.begin(), sorted.end());
  const std::vector<double> rows = MergeClose(ClusterMiddles(sorted));
  if (columns.size() < 2 || rows.size() < 2) return std::nullopt;
  if (rows.size() > 4 * points.size() / columns.size()) return std::nullopt;

  LooseGrid grid;
  grid.fill_missing_lines = true;
  grid.range.assign(columns.size() * rows.size(), RangeImage::kNoReturn);
  grid.source.assign(grid.range.size(), GriddedScan::kNoSource);
  std::vector<std::vector<std::pair<double, double>>> column_azimuths(columns.size());
  std::vector<std::vector<std::pair<double, double>>> row_elevations(rows.size());
  size_t duplicates = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const size_t column = NearestAround(columns, azimuths[i]);
    const size_t row = Nearest(rows, elevations[i]);
    float& cell = grid.range[column * rows.size() + row];
    if (RangeImage::IsRange(cell)) {
      ++duplicates;
      continue;
    }
    cell = points[i].norm();
    grid.source[column * rows.size() + row] = static_cast<uint32_t>(i);
    const double across = std::hypot(points[i].x(), points[i].y());
    const double from_middle = WrapAngle(azimuths[i] - columns[column]);
    if (across > 0) column_azimuths[column].emplace_back(from_middle, across);
    row_elevations[row].emplace_back(elevations[i], cell);
  }
  for (size_t i = 0; i < columns.size(); ++i) {
    std::vector<std::pair<double, double>>& around = column_azimuths[i];
    grid.azimuth.push_back(WrapAngle(columns[i] + (around.empty() ? 0 : WeightedMedian(around))));
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    std::vector<std::pair<double, double>>& around = row_elevations[i];
    grid.elevation.push_back(around.empty() ? rows[i] : WeightedMedian(around));
  }
  absl::StatusOr<GriddedScan> scan = AssembleGrid(std::move(grid));
  if (scan.ok()) scan->duplicates += duplicates;
  return scan;
}

// The mean spacing of different directions: root of solid angle covered per direction.
double MeanSpacing(const std::vector<double>& azimuths, const std::vector<double>& elevations) {
  constexpr int kPerHalfTurn = 90;  // bins of 2 degrees
  constexpr double kBin = kPi / kPerHalfTurn;
  std::vector<size_t> order(azimuths.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto key = [&](size_t i) { return std::pair(elevations[i], azimuths[i]); };
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
  std::vector<uint8_t> covered(2 * kPerHalfTurn * kPerHalfTurn, 0);
  double solid_angle = 0;
  size_t directions = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    if (i > 0 && key(order[i]) == key(order[i - 1])) continue;
    ++directions;
    const int row =
        std::clamp(static_cast<int>((elevations[order[i]] + kPi / 2) / kBin), 0, kPerHalfTurn - 1);
    const int column =
        std::clamp(static_cast<int>((azimuths[order[i]] + kPi) / kBin), 0, 2 * kPerHalfTurn - 1);
    uint8_t& bin = covered[static_cast<size_t>(row * 2 * kPerHalfTurn + column)];
    if (bin != 0) continue;
    bin = 1;
    const double bottom = -kPi / 2 + row * kBin;
    solid_angle += kBin * (std::sin(bottom + kBin) - std::sin(bottom));
  }
  return std::sqrt(solid_angle / static_cast<double>(directions));
}

// True of a grid with far more cells than there are points: a few of these do not make it huge.
bool MostlyEmpty(double cells, size_t points) {
  return cells > 16.0 * static_cast<double>(points) + 4096;
}

// The lines of rule 4, as a range image without ranges.
absl::StatusOr<RangeImage> EvenLines(size_t points, const std::vector<double>& azimuths,
                                     const std::vector<double>& elevations) {
  const double spacing = MeanSpacing(azimuths, elevations);
  const double wanted = 1.25 * spacing;
  const auto [low, high] = std::minmax_element(elevations.begin(), elevations.end());
  const std::vector<double> unrolled = UnrollAtWidestGap(azimuths);
  const double widest = unrolled.front() + 2 * kPi - unrolled.back();
  RangeImage lines;
  lines.full_turn = widest <= 3 * wanted;
  lines.native_azimuth_step = spacing;
  lines.native_elevation_step = spacing;
  const double span = lines.full_turn ? 2 * kPi : unrolled.back() - unrolled.front();
  const double first = lines.full_turn ? -kPi : unrolled.front();
  const auto count = [wanted](double extent) {
    return std::clamp(std::ceil(extent / wanted), 0.0, 1e6);
  };
  const double columns = count(span);
  const double rows = count(*high - *low);
  if (columns < 2 || rows < 2 || MostlyEmpty(columns * rows, points)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", points, " returns do not make a scan from one centre of projection at ",
        "the origin; transform them into the scanner's frame"));
  }
  for (double i = 0; i < columns; ++i) lines.azimuth.push_back(first + span * (i + 0.5) / columns);
  for (double i = 0; i < rows; ++i) {
    lines.elevation.push_back(*low + (*high - *low) * (i + 0.5) / rows);
  }
  return lines;
}

// Rules 2 to 4.
absl::StatusOr<GriddedScan> GridReturns(std::span<const Eigen::Vector3f> returns,
                                        const std::vector<double>& azimuths,
                                        const std::vector<double>& elevations,
                                        const std::optional<RangeImage>& leaning) {
  if (std::optional<absl::StatusOr<GriddedScan>> grid = FindGrid(returns, azimuths, elevations)) {
    return *std::move(grid);
  }
  if (leaning.has_value() && !MostlyEmpty(static_cast<double>(leaning->cells()), returns.size())) {
    GriddedScan scan = Resample(returns, WithLinesFor(*leaning, azimuths, elevations));
    scan.leaning = true;
    const bool keeps = scan.duplicates <= kLostToLeaning * static_cast<double>(returns.size());
    if (keeps && scan.image.Validate().ok()) return scan;
  }
  const absl::StatusOr<RangeImage> lines = EvenLines(returns.size(), azimuths, elevations);
  if (!lines.ok()) return lines.status();
  GriddedScan scan = Resample(returns, *lines);
  if (absl::Status valid = scan.image.Validate(); !valid.ok()) return valid;
  return scan;
}

}  // namespace

absl::StatusOr<GriddedScan> GridDirections(std::span<const Eigen::Vector3f> points,
                                           const std::optional<RangeImage>& leaning) {
  std::vector<Eigen::Vector3f> returns;
  std::vector<uint32_t> numbers;
  std::vector<double> azimuths;
  std::vector<double> elevations;
  returns.reserve(points.size());
  for (const Eigen::Vector3f& p : points) {
    if (p.isZero(0)) continue;
    returns.push_back(p);
    numbers.push_back(static_cast<uint32_t>(&p - points.data()));
    azimuths.push_back(AzimuthOf(p));
    elevations.push_back(ElevationOf(p));
  }
  if (returns.size() < 4) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", returns.size(), " returns; a range image needs at least 2 x 2 cells"));
  }
  absl::StatusOr<GriddedScan> scan = GridReturns(returns, azimuths, elevations, leaning);
  if (!scan.ok()) return scan;
  for (uint32_t& source : scan->source) {
    if (source != GriddedScan::kNoSource) source = numbers[source];
  }
  return scan;
}

}  // namespace vantage::sensor
