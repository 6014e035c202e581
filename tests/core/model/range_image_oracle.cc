#include "tests/core/model/range_image_oracle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/core/model/triangle_distance.h"

namespace vantage::model {
namespace {

uint64_t Packed(const VoxelIndex& v) {
  const auto part = [](int x) { return static_cast<uint64_t>(x + (1 << 20)); };
  return part(v.z()) << 42 | part(v.y()) << 21 | part(v.x());
}

// Into [from, from + 2 pi).
double Wrapped(double angle, double from) {
  return angle - 2 * sensor::kPi * std::floor((angle - from) / (2 * sensor::kPi));
}

}  // namespace

RangeImageOracle::RangeImageOracle(const sensor::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                                   double voxel_size, double discontinuity_angle)
    : azimuth_(scan.image.azimuth),
      elevation_(scan.image.elevation),
      full_turn_(scan.image.full_turn),
      range_(scan.image.range),
      T_scan_model_(T_model_scan.inverse()),
      voxel_size_(voxel_size),
      five_sigma_(5 * std::sqrt(2.0) * scan.scanner.RangeSigma(scan.scanner.range_max)),
      tangent_(std::tan(discontinuity_angle)) {
  const int columns = scan.image.columns();
  const int rows = scan.image.rows();
  for (float& range : range_) {
    if (range > 0 && range < static_cast<float>(scan.scanner.range_min)) {
      range = sensor::RangeImage::kNoInformation;
    }
  }
  // A cell's neighbours on its own surface, and along which axes it lies between two on others.
  struct Cell {
    std::vector<size_t> same;
    bool between[2] = {false, false};  // in its row, in its column
  };
  std::vector<Cell> cells(range_.size());
  for (int c = 0; c < columns; ++c) {
    const int right = c + 1 < columns ? c + 1 : (full_turn_ ? 0 : -1);
    const int left = c > 0 ? c - 1 : (full_turn_ ? columns - 1 : -1);
    for (int r = 0; r < rows; ++r) {
      const float here = At(c, r);
      if (!(here > 0)) continue;
      Cell& cell = cells[scan.image.Index(c, r)];
      const auto look = [&](int c0, int r0, int c1, int r1, bool& between) {
        const bool before = c0 >= 0 && r0 >= 0;
        const bool after = c1 >= 0 && r1 < rows;
        const bool same_before = before && OneSurface(c0, r0, c, r);
        const bool same_after = after && OneSurface(c, r, c1, r1);
        if (same_before) cell.same.push_back(scan.image.Index(c0, r0));
        if (same_after) cell.same.push_back(scan.image.Index(c1, r1));
        if (!before || !after || same_before || same_after) return;
        between = At(c0, r0) > 0 && At(c1, r1) > 0 && (here - At(c0, r0)) * (At(c1, r1) - here) > 0;
      };
      look(left, r, right, r, cell.between[0]);
      look(c, r - 1, c, r + 1, cell.between[1]);
    }
  }
  std::vector<size_t> mixed;
  for (size_t index = 0; index < cells.size(); ++index) {
    const Cell& cell = cells[index];
    if (!cell.between[0] && !cell.between[1]) continue;
    if (cell.same.size() == 1) {
      const Cell& other = cells[cell.same.front()];
      const bool both =
          (cell.between[0] && other.between[0]) || (cell.between[1] && other.between[1]);
      if (other.same.size() != 1 || !both) continue;
    } else if (!cell.same.empty()) {
      continue;
    }
    mixed.push_back(index);
  }
  for (const size_t index : mixed) range_[index] = sensor::RangeImage::kNoInformation;
  passed_.resize(range_.size(), sensor::RangeImage::kNoInformation);
  for (int c = 0; c < columns; ++c) {
    for (int r = 0; r < rows; ++r) {
      if (At(c, r) > 0) continue;
      const auto beside = [&](int dc, int dr) {
        const int column = full_turn_ ? (c + dc + columns) % columns : c + dc;
        const bool outside = column < 0 || column >= columns || r + dr < 0 || r + dr >= rows;
        return outside ? 0.0f : At(column, r + dr);
      };
      std::vector<float> around;
      for (int i = 0; i < 9; ++i) {
        const float range = beside(i % 3 - 1, i / 3 - 1);
        if (range > 0) around.push_back(range);
      }
      std::vector<float> mixing;
      const auto pair = [&mixing](float a, float b) {
        if (a > 0 && b > 0) mixing.insert(mixing.end(), {a, b});
      };
      if (std::binary_search(mixed.begin(), mixed.end(), CellOf(c, r))) {
        pair(beside(-1, 0), beside(1, 0));
        pair(beside(0, -1), beside(0, 1));
      }
      const std::vector<float>& good = mixing.empty() ? around : mixing;
      if (!mixing.empty() || around.size() >= 7) {
        passed_[CellOf(c, r)] = *std::min_element(good.begin(), good.end());
      }
    }
  }

  for (int c = 0; c < columns; ++c) {
    const int next = c + 1 < columns ? c + 1 : (full_turn_ ? 0 : -1);
    for (int r = 0; r < rows; ++r) {
      const int right = next >= 0 && OneSurface(c, r, next, r) ? 1 : 0;
      const int up = r + 1 < rows && OneSurface(c, r, c, r + 1) ? 2 : 0;
      joined_.push_back(static_cast<uint8_t>(right | up));
      direction_.push_back(scan.image.Direction(c, r));
      if (!(At(c, r) > 0)) continue;
      const Eigen::Vector3d p =
          T_model_scan * (static_cast<double>(At(c, r)) * direction_.back()) / voxel_size;
      const Eigen::Vector3d low = p.array().floor();
      const Eigen::Array3d in = (p - low).array();
      // Nearer to a face than this, rounding may put it next door.
      if (in.minCoeff() > 2e-3 && in.maxCoeff() < 1 - 2e-3) {
        sampled_.insert(Packed(low.cast<int>()));
      }
    }
  }
}

bool RangeImageOracle::OneSurface(int column_a, int row_a, int column_b, int row_b) const {
  constexpr double kWidestGap = 0.1;  // rad: not scanned between
  const auto a = static_cast<double>(At(column_a, row_a));
  const auto b = static_cast<double>(At(column_b, row_b));
  if (!(a > 0 && b > 0)) return false;
  const double elevation = elevation_[static_cast<size_t>(row_a)];
  double angle = elevation_[static_cast<size_t>(row_b)] - elevation;
  if (row_a == row_b) {
    const double turn = Wrapped(
        azimuth_[static_cast<size_t>(column_b)] - azimuth_[static_cast<size_t>(column_a)], 0);
    if (turn >= kWidestGap) return false;
    angle = turn * std::cos(elevation);
  } else if (angle >= kWidestGap) {
    return false;
  }
  const double difference = std::abs(a - b);
  return difference <= five_sigma_ || std::min(a, b) * angle >= difference * tangent_;
}

RangeImageOracle::Place RangeImageOracle::Column(double azimuth) const {
  const int count = static_cast<int>(azimuth_.size());
  const double angle = Wrapped(azimuth, azimuth_.front());
  Place place;
  if (angle > azimuth_.back()) {  // after the last column, before the first
    const double gap = azimuth_.front() + 2 * sensor::kPi - azimuth_.back();
    const double share = (angle - azimuth_.back()) / gap;
    if (full_turn_) return {count - 1, 0, share, true};
    const auto n = static_cast<size_t>(count);
    if (angle - azimuth_.back() <= 0.5 * (azimuth_[n - 1] - azimuth_[n - 2])) {
      return {count - 1, count - 1, 0, true};
    }
    if (azimuth_.front() + 2 * sensor::kPi - angle <= 0.5 * (azimuth_[1] - azimuth_[0])) {
      return {0, 0, 0, true};
    }
    return place;
  }
  const auto next = std::upper_bound(azimuth_.begin(), azimuth_.end(), angle);
  place.lower = static_cast<int>(next - azimuth_.begin()) - 1;
  place.upper = std::min(place.lower + 1, count - 1);
  const double below = azimuth_[static_cast<size_t>(place.lower)];
  const double above = azimuth_[static_cast<size_t>(place.upper)];
  place.fraction = above > below ? (angle - below) / (above - below) : 0;
  place.inside = true;
  return place;
}

RangeImageOracle::Place RangeImageOracle::Row(double elevation) const {
  const size_t count = elevation_.size();
  Place place;
  if (elevation < elevation_[0]) {
    place.inside = elevation_[0] - elevation <= 0.5 * (elevation_[1] - elevation_[0]);
    return place;
  }
  const auto next = std::upper_bound(elevation_.begin(), elevation_.end(), elevation);
  place.lower = static_cast<int>(next - elevation_.begin()) - 1;
  if (next == elevation_.end()) {
    place.upper = place.lower;
    place.inside =
        elevation - elevation_.back() <= 0.5 * (elevation_[count - 1] - elevation_[count - 2]);
    return place;
  }
  place.upper = place.lower + 1;
  const double below = elevation_[static_cast<size_t>(place.lower)];
  place.fraction = (elevation - below) / (*next - below);
  place.inside = true;
  return place;
}

double RangeImageOracle::RangeAlong(double azimuth, double elevation) const {
  const Place c = Column(azimuth);
  const Place r = Row(elevation);
  if (!c.inside || !r.inside) return std::numeric_limits<double>::quiet_NaN();
  const auto joined = [&](int column, int row, int bit) {
    return (joined_[CellOf(column, row)] & bit) != 0;
  };
  if (c.lower != c.upper && r.lower != r.upper && joined(c.lower, r.lower, 1) &&
      joined(c.lower, r.upper, 1) && joined(c.lower, r.lower, 2) && joined(c.upper, r.lower, 2)) {
    const auto inverse = [&](int row) {
      return (1 - c.fraction) / static_cast<double>(At(c.lower, row)) +
             c.fraction / static_cast<double>(At(c.upper, row));
    };
    return 1 / ((1 - r.fraction) * inverse(r.lower) + r.fraction * inverse(r.upper));
  }
  const size_t nearest =
      CellOf(c.fraction < 0.5 ? c.lower : c.upper, r.fraction < 0.5 ? r.lower : r.upper);
  const float range = range_[nearest] > 0 ? range_[nearest] : passed_[nearest];
  return range > 0 ? static_cast<double>(range) : std::numeric_limits<double>::quiet_NaN();
}

double RangeImageOracle::Room(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = T_scan_model_ * point;
  return RangeAlong(std::atan2(p.y(), p.x()), std::atan2(p.z(), p.head<2>().norm())) - p.norm();
}

RangeImageOracle::Verdict RangeImageOracle::Of(const VoxelIndex& voxel, double centre,
                                               const std::array<double, 8>& corners) const {
  if (sampled_.contains(Packed(voxel))) return Verdict::kNotEmpty;
  if (std::isnan(centre)) return ByManyPoints(voxel);
  if (centre <= 0) return Verdict::kNotEmpty;
  const double diagonal = std::sqrt(3.0) * voxel_size_;
  const bool crossed = std::any_of(corners.begin(), corners.end(), [&](double corner) {
    return corner <= 0 && corner > -diagonal;
  });
  return crossed ? Verdict::kEmptyOrSurface : Verdict::kEmpty;
}

RangeImageOracle::Verdict RangeImageOracle::ByManyPoints(const VoxelIndex& voxel) const {
  constexpr int kAcross = 5;
  constexpr int kAll = kAcross * kAcross * kAcross;
  int known = 0;
  int front = 0;
  for (int i = 0; i < kAll; ++i) {
    const Eigen::Array3d at =
        Eigen::Array3i(i % kAcross, i / kAcross % kAcross, i / (kAcross * kAcross)).cast<double>();
    const double room =
        Room((voxel.cast<double>().array() + (at + 0.5) / kAcross).matrix() * voxel_size_);
    known += std::isnan(room) ? 0 : 1;
    front += room > 0 ? 1 : 0;
  }
  if (4 * front <= known) return Verdict::kNotEmpty;
  return 4 * known >= 3 * kAll && 4 * front >= 3 * known ? Verdict::kEmpty
                                                         : Verdict::kAcrossTheBorder;
}

bool RangeImageOracle::NearTriangle(const VoxelIndex& voxel) const {
  const Eigen::Vector3d p = T_scan_model_ * CentreOf(voxel);
  const double reach = std::sqrt(3.0) / 2 * voxel_size_;
  const int columns = static_cast<int>(azimuth_.size());
  const int rows = static_cast<int>(elevation_.size());
  const auto place = [&](int c, int r) -> Eigen::Vector3d {
    return static_cast<double>(At(c, r)) * direction_[CellOf(c, r)];
  };
  // Every cell whose ray passes near: a triangle's rays lie a cell apart, so its nearest point may
  // lie well beside each of them.
  const double angle = std::asin(std::min(1.0, 2 * reach / p.norm()));
  const double level = p.head<2>().norm();
  const double elevation = std::atan2(p.z(), level);
  const Place column = Column(std::atan2(p.y(), p.x()));
  const Place row = Row(elevation);
  const double turn = std::min(sensor::kPi, angle * p.norm() / std::max(level, 1e-6));
  const int aside = std::min(columns / 2, 2 + static_cast<int>(turn / (azimuth_[1] - azimuth_[0])));
  const int along = 2 + static_cast<int>(angle / (elevation_[1] - elevation_[0]));
  for (int i = -aside; i <= aside; ++i) {
    const int c = (column.lower + i + columns) % columns;
    const int next = c + 1 < columns ? c + 1 : (full_turn_ ? 0 : -1);
    if (next < 0) continue;
    for (int r = std::max(0, row.lower - along); r < std::min(rows - 1, row.lower + along); ++r) {
      const bool below = (joined_[CellOf(c, r)] & 1) != 0;
      const bool above = (joined_[CellOf(c, r + 1)] & 1) != 0;
      const bool left = (joined_[CellOf(c, r)] & 2) != 0;
      const bool right = (joined_[CellOf(next, r)] & 2) != 0;
      const std::array<Eigen::Vector3d, 4> corner = {place(c, r), place(next, r),
                                                     place(next, r + 1), place(c, r + 1)};
      const auto near = [&](bool both, size_t a, size_t b, size_t d) {
        return both && TriangleDistance(p, {corner[a], corner[b], corner[d]}) < reach;
      };
      if (near(left && below, 3, 0, 1) || near(below && right, 0, 1, 2) ||
          near(right && above, 1, 2, 3) || near(above && left, 2, 3, 0)) {
        return true;
      }
    }
  }
  return false;
}

bool RangeImageOracle::IsTie(const VoxelIndex& voxel) const {
  constexpr double kRounding = 5e-6;
  const Eigen::Vector3d p = T_scan_model_ * CentreOf(voxel);
  const double distance = p.norm();
  const double azimuth = std::atan2(p.y(), p.x());
  const double elevation = std::atan2(p.z(), p.head<2>().norm());
  int front = 0;
  int behind = 0;
  int unknown = 0;
  for (const double turn : {-kRounding, 0.0, kRounding}) {
    for (const double rise : {-kRounding, 0.0, kRounding}) {
      const double range = RangeAlong(azimuth + turn, elevation + rise);
      for (const double stretch : {1 - kRounding, 1 + kRounding}) {
        unknown += std::isnan(range) ? 1 : 0;
        front += range > distance * stretch ? 1 : 0;
        behind += range <= distance * stretch ? 1 : 0;
      }
    }
  }
  return std::max({front, behind, unknown}) < front + behind + unknown;
}

}  // namespace vantage::model
