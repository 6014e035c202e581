#include "core/sensor/resampling.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/sensor/loose_grid.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {
namespace {

constexpr uint32_t kFreeCell = std::numeric_limits<uint32_t>::max();

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

}  // namespace

size_t Nearest(const std::vector<double>& rising, double value) {
  const auto above = std::lower_bound(rising.begin(), rising.end(), value);
  if (above == rising.begin()) return 0;
  const auto i = static_cast<size_t>(above - rising.begin());
  if (above == rising.end()) return i - 1;
  return *above - value < value - rising[i - 1] ? i : i - 1;
}

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

GriddedScan Resample(std::span<const Eigen::Vector3f> returns, RangeImage lines) {
  GriddedScan result;
  result.resampled = true;
  result.image = std::move(lines);
  RangeImage& image = result.image;
  // The point nearest to each cell's direction; the first stored of equals.
  std::vector<uint32_t> nearest(image.cells(), kFreeCell);
  std::vector<float> off(image.cells(), std::numeric_limits<float>::infinity());  // squared
  for (size_t i = 0; i < returns.size(); ++i) {
    const auto column = static_cast<int>(NearestAround(image.azimuth, AzimuthOf(returns[i])));
    const auto row = static_cast<int>(Nearest(image.elevation, ElevationOf(returns[i])));
    const size_t cell = image.Index(column, row);
    const auto here = static_cast<float>(
        (returns[i].cast<double>().normalized() - image.Direction(column, row)).squaredNorm());
    if (nearest[cell] != kFreeCell) ++result.duplicates;
    if (here < off[cell]) {
      nearest[cell] = static_cast<uint32_t>(i);
      off[cell] = here;
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
      if (const uint32_t own = at(column, row); own != kFreeCell) {
        around.clear();
        for (int dc = -1; dc <= 1; ++dc) {
          for (int dr = -1; dr <= 1; ++dr) {
            const uint32_t i = at(column + dc, row + dr);
            if (i != kFreeCell) around.push_back(returns[i].cast<double>());
          }
        }
        result.source.push_back(own);
        image.range.push_back(
            RangeOfPlane(image.Direction(column, row), around, returns[own].norm()));
        continue;
      }
      result.source.push_back(GriddedScan::kNoSource);
      const auto holds = [&](int dc, int dr) { return at(column + dc, row + dr) != kFreeCell; };
      const bool between = (holds(-1, 0) && holds(1, 0)) || (holds(0, -1) && holds(0, 1));
      image.range.push_back(between ? RangeImage::kNoInformation : RangeImage::kNoReturn);
    }
  }
  return result;
}

}  // namespace vantage::sensor
