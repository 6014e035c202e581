#include "core/registration/bound/direction_words.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// An undirected axis: within 20 degrees of a coordinate axis it gets that name.
struct AxisWords {
  std::string along;   // 'x': where the job's axes point is nobody's but the job's to say
  std::string facing;  // '+x or -x'
  bool vertical = false;
};

AxisWords NameAxis(Eigen::Vector3d axis) {
  axis.normalize();
  constexpr double kNear = 0.94;  // cos 20 degrees
  if (std::abs(axis.x()) > kNear) return {"x", "+x or -x", false};
  if (std::abs(axis.y()) > kNear) return {"y", "+y or -y", false};
  if (std::abs(axis.z()) > kNear) return {"z (up-down)", "up or down", true};
  double bearing = sensor::Degrees(std::atan2(axis.y(), axis.x()));
  if (bearing < 0) bearing += 180.0;
  const double climb = sensor::Degrees(std::asin(std::min(1.0, std::abs(axis.z()))));
  if (climb < 20) {
    return {absl::StrFormat("%.0f degrees from x towards y", bearing),
            absl::StrFormat("%.0f degrees from x towards y, or its opposite", bearing), false};
  }
  return {absl::StrFormat("%.0f degrees from x towards y, sloping %.0f degrees", bearing, climb),
          absl::StrFormat("%.0f degrees from x towards y at a slope", bearing), false};
}

}  // namespace

DirectionWords DescribeDirection(const sensor::Vector6d& weakest, double reach) {
  const Eigen::Vector3d turn = weakest.head<3>();
  const Eigen::Vector3d slide = weakest.tail<3>();
  const double turned = turn.norm() * reach;  // m, at the overlap's edge
  if (turned < slide.norm() && turned < 0.7 * slide.norm()) {
    const AxisWords axis = NameAxis(slide);
    if (axis.vertical) {
      return {absl::StrCat("sliding along ", axis.along),
              "stand where floor, ceiling or other level surface already scanned is in view"};
    }
    return {absl::StrCat("sliding along ", axis.along),
            absl::StrCat("stand where a surface already scanned that faces ", axis.facing,
                         " is in view (a doorway, an end wall, furniture), or place two targets "
                         "apart along that direction")};
  }
  const AxisWords axis = NameAxis(turn);
  // The part of the motion across the axis moves the axis away from the centroid.
  const Eigen::Vector3d offset = turn.cross(slide) / turn.squaredNorm();
  const bool offset_matters = offset.norm() > 0.25 * reach;
  const std::string place =
      offset_matters ? absl::StrFormat(", %.1f m off the middle of the overlap", offset.norm())
                     : std::string();
  if (axis.vertical) {
    return {absl::StrCat("turning about the vertical", place),
            "stand where flat walls already scanned are in view over a wider part of the room, or "
            "place two targets far apart"};
  }
  return {absl::StrCat("tilting about ", axis.along, place),
          "level the scanner with its inclinometer, or stand where more floor or ceiling already "
          "scanned is in view"};
}

}  // namespace vantage::registration
