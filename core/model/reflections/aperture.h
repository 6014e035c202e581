// The part of a plane that is known to reflect.
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_APERTURE_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_APERTURE_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

namespace vantage::model {

class Aperture {
 public:
  // The plane normal . x = -distance (m; the normal points to the side that reflects), where it is
  // within a decimetre or two of one of `points` (m, on the plane).
  Aperture(const Eigen::Vector3d& normal, double distance, std::span<const Eigen::Vector3d> points);

  // The same, seen from another frame.
  Aperture InFrame(const Eigen::Isometry3d& T_to_from) const;

  // m, positive on the side that reflects.
  double Above(const Eigen::Vector3d& point) const { return normal_.dot(point) + distance_; }

  // Does the segment from `station` (on the side that reflects) to `point` pass through it?
  bool Between(const Eigen::Vector3d& station, const Eigen::Vector3d& point) const;

  // The middles (m) of its parts, a decimetre wide and high, that lie well within its border, which
  // is known to within a decimetre or two.
  std::vector<Eigen::Vector3d> Inner() const;

  // False when no point within `radius` (m) of `middle` can have the aperture before it as seen
  // from `station`. Conservative.
  bool MayHide(const Eigen::Vector3d& station, const Eigen::Vector3d& middle, double radius) const;

  bool operator==(const Aperture&) const = default;

 private:
  friend class LayerCodec;  // snapshots
  // False outside.
  bool InsideAt(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns_ && row < rows_ &&
           inside_[static_cast<size_t>(column) +
                   static_cast<size_t>(columns_) * static_cast<size_t>(row)] != 0;
  }
  // m: a point fills the cells around its own, so that the border is a decimetre too far out. Rays
  // of one degree are two cells apart eleven metres away; from farther they would leave gaps.
  static constexpr double kCell = 0.10;

  Eigen::Vector3d normal_;
  double distance_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // lowest corner, on the plane
  Eigen::Vector3d axis_u_;                            // unit
  Eigen::Vector3d axis_v_;
  int columns_ = 0;
  int rows_ = 0;
  std::vector<uint8_t> inside_;  // per cell, u fastest
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_APERTURE_H_
