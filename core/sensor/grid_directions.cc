#include "core/sensor/grid_directions.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/sensor/loose_grid.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {
namespace {

constexpr double kWellConditioned = Radians(80);  // elevations whose azimuth can be trusted
constexpr double kFinestGap = 2e-6;               // rad; what is closer is the same direction
constexpr double kClusterRatio = 10;              // gaps between clusters over gaps inside
constexpr size_t kFreeCell = std::numeric_limits<size_t>::max();

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

size_t Nearest(const std::vector<double>& rising, double value) {
  const auto above = std::lower_bound(rising.begin(), rising.end(), value);
  if (above == rising.begin()) return 0;
  const auto i = static_cast<size_t>(above - rising.begin());
  if (above == rising.end()) return i - 1;
  return *above - value < value - rising[i - 1] ? i : i - 1;
}

// The azimuth within half a turn of the axis' middle, the nearest over the cut included.
size_t NearestAround(const std::vector<double>& rising, double azimuth) {
  const double middle = 0.5 * (rising.front() + rising.back());
  const double unrolled = middle + WrapAngle(azimuth - middle);
  const size_t i = Nearest(rising, unrolled);
  const double direct = std::abs(rising[i] - unrolled);
  const double over_front = std::abs(rising.front() + 2 * kPi - unrolled);
  const double over_back = std::abs(unrolled + 2 * kPi - rising.back());
  if (over_front < direct) return 0;
  if (over_back < direct) return rising.size() - 1;
  return i;
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

// The range along `direction` of the plane through `around`, or `own` where they make none.
float RangeOfPlane(const Eigen::Vector3d& direction, const std::vector<Eigen::Vector3d>& around,
                   float own) {
  if (around.size() < 4) return own;
  // A plane is a . x = 1; along a unit direction d its range is 1 / (a . d).
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : around) {
    normal_matrix += p * p.transpose();
    right_side += p;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal_matrix);
  const Eigen::Vector3d a = solver.solve(right_side);
  if (!a.allFinite()) return own;
  for (const Eigen::Vector3d& p : around) {
    const double inverse = a.dot(p) / p.norm();
    if (!(inverse > 0)) return own;
    if (std::abs(1 / inverse - p.norm()) > 0.01 + 0.01 * p.norm()) return own;
  }
  const double inverse = a.dot(direction);
  if (!(inverse > 0)) return own;
  const double range = 1 / inverse;
  return std::abs(range - own) <= 0.1 * own ? static_cast<float>(range) : own;
}

// Rule 3.
absl::StatusOr<GriddedScan> Resample(std::span<const Eigen::Vector3f> points,
                                     const std::vector<double>& azimuths,
                                     const std::vector<double>& elevations) {
  const double spacing = MeanSpacing(azimuths, elevations);
  const double wanted = 1.25 * spacing;
  const auto [low, high] = std::minmax_element(elevations.begin(), elevations.end());
  const std::vector<double> unrolled = UnrollAtWidestGap(azimuths);
  const double widest = unrolled.front() + 2 * kPi - unrolled.back();

  GriddedScan result;
  result.resampled = true;
  RangeImage& image = result.image;
  image.full_turn = widest <= 3 * wanted;
  image.native_azimuth_step = spacing;
  image.native_elevation_step = spacing;
  const double span = image.full_turn ? 2 * kPi : unrolled.back() - unrolled.front();
  const double first = image.full_turn ? -kPi : unrolled.front();
  const auto lines = [wanted](double extent) {
    return std::clamp(std::ceil(extent / wanted), 0.0, 1e6);
  };
  const double columns = lines(span);
  const double rows = lines(*high - *low);
  // The lines are coarser than the points, so a grid far larger than them is mostly empty.
  if (columns < 2 || rows < 2 ||
      columns * rows > 16.0 * static_cast<double>(points.size()) + 4096) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", points.size(), " returns do not make a scan from one centre of projection at ",
        "the origin; transform them into the scanner's frame"));
  }
  for (double i = 0; i < columns; ++i) image.azimuth.push_back(first + span * (i + 0.5) / columns);
  for (double i = 0; i < rows; ++i) {
    image.elevation.push_back(*low + (*high - *low) * (i + 0.5) / rows);
  }
  // The point nearest to each cell's direction; the first stored of equals.
  std::vector<size_t> nearest(image.cells(), kFreeCell);
  std::vector<double> nearest_cos(image.cells(), -2);
  for (size_t i = 0; i < points.size(); ++i) {
    const double offset = std::remainder(azimuths[i] - first - span / 2, 2 * kPi) + span / 2;
    const auto column = static_cast<int>(std::clamp(offset / span * columns, 0.0, columns - 1));
    const auto row =
        static_cast<int>(std::clamp((elevations[i] - *low) / (*high - *low) * rows, 0.0, rows - 1));
    const size_t cell = image.Index(column, row);
    const double cos_angle =
        points[i].cast<double>().normalized().dot(image.Direction(column, row));
    if (nearest[cell] != kFreeCell) ++result.duplicates;
    if (cos_angle > nearest_cos[cell]) {
      nearest[cell] = i;
      nearest_cos[cell] = cos_angle;
    }
  }
  const auto at = [&](int column, int row) {
    if (image.full_turn) column = (column + image.columns()) % image.columns();
    if (column < 0 || column >= image.columns() || row < 0 || row >= image.rows()) return kFreeCell;
    return nearest[image.Index(column, row)];
  };
  image.range.reserve(image.cells());
  std::vector<Eigen::Vector3d> around;
  for (int column = 0; column < image.columns(); ++column) {
    for (int row = 0; row < image.rows(); ++row) {
      if (const size_t own = at(column, row); own != kFreeCell) {
        around.clear();
        for (int dc = -1; dc <= 1; ++dc) {
          for (int dr = -1; dr <= 1; ++dr) {
            const size_t i = at(column + dc, row + dr);
            if (i != kFreeCell) around.push_back(points[i].cast<double>());
          }
        }
        image.range.push_back(
            RangeOfPlane(image.Direction(column, row), around, points[own].norm()));
        continue;
      }
      const auto holds = [&](int dc, int dr) { return at(column + dc, row + dr) != kFreeCell; };
      const bool between = (holds(-1, 0) && holds(1, 0)) || (holds(0, -1) && holds(0, 1));
      image.range.push_back(between ? RangeImage::kNoInformation : RangeImage::kNoReturn);
    }
  }
  if (absl::Status valid = image.Validate(); !valid.ok()) return valid;
  return result;
}

}  // namespace

absl::StatusOr<GriddedScan> GridDirections(std::span<const Eigen::Vector3f> points) {
  std::vector<Eigen::Vector3f> returns;
  std::vector<double> azimuths;
  std::vector<double> elevations;
  returns.reserve(points.size());
  for (const Eigen::Vector3f& p : points) {
    if (p.isZero(0)) continue;
    returns.push_back(p);
    azimuths.push_back(AzimuthOf(p));
    elevations.push_back(ElevationOf(p));
  }
  if (returns.size() < 4) {
    return absl::InvalidArgumentError(absl::StrCat(
        "points: ", returns.size(), " returns; a range image needs at least 2 x 2 cells"));
  }
  if (std::optional<absl::StatusOr<GriddedScan>> grid = FindGrid(returns, azimuths, elevations)) {
    return *std::move(grid);
  }
  return Resample(returns, azimuths, elevations);
}

}  // namespace vantage::sensor
