#include "core/model/reflections/aperture.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vantage::model {

Aperture::Aperture(const Eigen::Vector3d& normal, double distance,
                   std::span<const Eigen::Vector3d> points)
    : normal_(normal),
      distance_(distance),
      axis_u_(normal.unitOrthogonal()),
      axis_v_(normal.cross(axis_u_)) {
  if (points.empty()) return;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector2d uv(axis_u_.dot(point), axis_v_.dot(point));
    low = low.cwiseMin(uv);
    high = high.cwiseMax(uv);
  }
  // A cell more around, since each point fills the cells next to its own too.
  low = (low / kCell).array().floor() * kCell - kCell;
  columns_ = static_cast<int>((high.x() - low.x()) / kCell) + 2;
  rows_ = static_cast<int>((high.y() - low.y()) / kCell) + 2;
  origin_ = low.x() * axis_u_ + low.y() * axis_v_ - distance * normal;
  inside_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), 0);
  for (const Eigen::Vector3d& point : points) {
    const int u = static_cast<int>(axis_u_.dot(point - origin_) / kCell);
    const int v = static_cast<int>(axis_v_.dot(point - origin_) / kCell);
    for (int dv = std::max(0, v - 1); dv <= std::min(rows_ - 1, v + 1); ++dv) {
      for (int du = std::max(0, u - 1); du <= std::min(columns_ - 1, u + 1); ++du) {
        inside_[static_cast<size_t>(du) + static_cast<size_t>(columns_) * static_cast<size_t>(dv)] =
            1;
      }
    }
  }
}

Aperture Aperture::InFrame(const Eigen::Isometry3d& T_to_from) const {
  Aperture moved = *this;
  moved.normal_ = T_to_from.linear() * normal_;
  moved.axis_u_ = T_to_from.linear() * axis_u_;
  moved.axis_v_ = T_to_from.linear() * axis_v_;
  moved.origin_ = T_to_from * origin_;
  moved.distance_ = distance_ - moved.normal_.dot(T_to_from.translation());
  return moved;
}

std::vector<Eigen::Vector3d> Aperture::Inner() const {
  constexpr int kBorder = 2;  // cells: one that each point fills besides its own, and one more
  std::vector<Eigen::Vector3d> middles;
  for (int v = 0; v < rows_; ++v) {
    for (int u = 0; u < columns_; ++u) {
      if (!InsideAt(u, v) || !InsideAt(u - kBorder, v) || !InsideAt(u + kBorder, v) ||
          !InsideAt(u, v - kBorder) || !InsideAt(u, v + kBorder)) {
        continue;
      }
      middles.push_back(origin_ + (u + 0.5) * kCell * axis_u_ + (v + 0.5) * kCell * axis_v_);
    }
  }
  return middles;
}

bool Aperture::MayHide(const Eigen::Vector3d& station, const Eigen::Vector3d& middle,
                       double radius) const {
  const double before = Above(station);
  if (before <= 0 || Above(middle) > radius) return false;
  const double behind = std::max(0.0, -Above(middle));
  const Eigen::Vector3d way = middle - station;
  const Eigen::Vector3d crossing = station + way * std::min(1.0, before / (before + behind));
  // How far the crossing moves with the point, the more the flatter the ray.
  const double reach = radius * (1 + way.norm() / before);
  const double u = axis_u_.dot(crossing - origin_);
  const double v = axis_v_.dot(crossing - origin_);
  return u > -reach && v > -reach && u < columns_ * kCell + reach && v < rows_ * kCell + reach;
}

bool Aperture::Between(const Eigen::Vector3d& station, const Eigen::Vector3d& point) const {
  const double before = Above(station);
  const double behind = -Above(point);
  if (before <= 0 || behind <= 0) return false;
  const Eigen::Vector3d crossing = station + (point - station) * (before / (before + behind));
  const double u = axis_u_.dot(crossing - origin_) / kCell;
  const double v = axis_v_.dot(crossing - origin_) / kCell;
  if (u < 0 || v < 0 || u >= columns_ || v >= rows_) return false;
  return inside_[static_cast<size_t>(u) + static_cast<size_t>(columns_) * static_cast<size_t>(v)] !=
         0;
}

}  // namespace vantage::model
