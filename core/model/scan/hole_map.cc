#include "core/model/scan/hole_map.h"

#include <algorithm>
#include <cmath>

namespace vantage::model {
namespace {

// 7,200 bins: a voxel of 5 cm fills one at a metre. Wider where rays are farther apart than three
// quarters of a degree, so that a bin has some to judge by.
constexpr double kBin = sensor::Radians(3);  // rad
constexpr double kRaysPerBin = 4;            // at least, along each axis
constexpr double kMostRaysPerBin = 16;       // looked at along each axis: 256 tell a majority

// The bin of an angle that starts from 0.
int BinOf(double angle, double span, int bins) {
  return static_cast<int>(std::clamp(angle / span * bins, 0.0, bins - 1.0));
}

double Azimuth(double angle) {
  return angle - 2 * sensor::kPi * std::floor(angle / (2 * sensor::kPi));
}

}  // namespace

HoleMap::HoleMap(const RangeSurface& surface) {
  const double step = std::max(surface.azimuth().widest_step(), surface.elevation().widest_step());
  const double bin = std::max(kBin, kRaysPerBin * step);
  columns_ = std::max(1, static_cast<int>(2 * sensor::kPi / bin));
  rows_ = std::max(1, static_cast<int>(sensor::kPi / bin));
  const auto stride = [&](const AngularAxis& axis) {
    const double mean = (axis.last() - axis.first()) / std::max(1, axis.size() - 1);
    return static_cast<int>(std::clamp<double>(bin / mean / kMostRaysPerBin, 1, axis.size()));
  };
  const int column_stride = stride(surface.azimuth());
  const int row_stride = stride(surface.elevation());
  std::vector<int32_t> balance(static_cast<size_t>(columns_ * rows_));  // holes less others
  std::vector<size_t> row_bin;
  for (const double elevation : surface.elevation().angles()) {
    row_bin.push_back(static_cast<size_t>(BinOf(elevation + sensor::kPi / 2, sensor::kPi, rows_)));
  }
  hole_.assign(balance.size(), 0);
  std::vector<uint8_t> met(balance.size());
  for (int c = 0; c < surface.columns(); c += column_stride) {
    const double azimuth = Azimuth(surface.azimuth().angles()[static_cast<size_t>(c)]);
    const auto first = static_cast<size_t>(BinOf(azimuth, 2 * sensor::kPi, columns_) * rows_);
    for (int r = 0; r < surface.rows(); r += row_stride) {
      const size_t at = first + row_bin[static_cast<size_t>(r)];
      balance[at] += surface.Hole(c, r) ? 1 : -1;
      met[at] = 1;
    }
  }
  for (size_t i = 0; i < hole_.size(); ++i) {
    if (met[i] == 0 || balance[i] < 0) continue;
    hole_[i] = 1;
    empty_ = false;
  }
}

bool HoleMap::Near(const Eigen::Vector3d& direction, double radius) const {
  if (empty_) return false;
  const double elevation = std::asin(std::clamp(direction.z() / direction.norm(), -1.0, 1.0));
  const int low = BinOf(elevation - radius + sensor::kPi / 2, sensor::kPi, rows_);
  const int high = BinOf(elevation + radius + sensor::kPi / 2, sensor::kPi, rows_);
  int first = 0;
  int count = columns_;
  // Except over a pole, where every azimuth is near.
  if (std::abs(elevation) + radius < sensor::kPi / 2 && std::sin(radius) < std::cos(elevation)) {
    const double turn = std::asin(std::sin(radius) / std::cos(elevation));
    const double azimuth = std::atan2(direction.y(), direction.x());
    first = BinOf(Azimuth(azimuth - turn), 2 * sensor::kPi, columns_);
    count = std::min(columns_, static_cast<int>(2 * turn / (2 * sensor::kPi) * columns_) + 2);
  }
  for (int i = 0; i < count; ++i) {
    const uint8_t* column = &hole_[static_cast<size_t>((first + i) % columns_ * rows_)];
    if (std::any_of(column + low, column + high + 1, [](uint8_t hole) { return hole != 0; })) {
      return true;
    }
  }
  return false;
}

}  // namespace vantage::model
