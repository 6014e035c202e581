#include "core/site_prior/prior_pose.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "core/site_prior/building_units.h"

namespace vantage::site_prior {
namespace {

constexpr double kPointsOff = 1.0;  // m that the distance of two points may be wrong by
constexpr double kScaleOff = 0.15;  // and the share of it

}  // namespace

Eigen::Vector3d PriorPose::ToModel(const Eigen::Vector3d& p) const {
  return translation + scale * (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * p);
}

Eigen::Vector3d PriorPose::ToPrior(const Eigen::Vector3d& p) const {
  return Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * ((p - translation) / scale);
}

absl::StatusOr<PriorPose> PlaceByPoints(const std::array<PlacedPoint, 2>& points, double scale) {
  const auto& [a, b] = points;
  if (!a.prior.allFinite() || !a.site.allFinite() || !b.prior.allFinite() || !b.site.allFinite()) {
    return absl::InvalidArgumentError("the two points need finite coordinates");
  }
  if (!(scale >= 0.1 && scale <= 10)) {
    return absl::InvalidArgumentError("the scale has to be in [0.1, 10]: give the unit instead");
  }
  const Eigen::Vector2d in_prior = scale * (b.prior - a.prior).head<2>();
  const Eigen::Vector2d at_site = (b.site - a.site).head<2>();
  const double apart = in_prior.norm();
  const double there = at_site.norm();
  if (std::abs(apart - there) > kPointsOff + kScaleOff * std::max(apart, there)) {
    std::string cure = "take the points again";
    for (const BuildingUnit& unit : kBuildingUnits) {
      if (std::abs(apart * unit.metres - there) <= kPointsOff + kScaleOff * there) {
        cure = absl::StrFormat("give the unit, %s", unit.name);
        break;
      }
    }
    return absl::InvalidArgumentError(
        absl::StrFormat("the two points are %.2f m apart in the prior and %.2f m at the site: %s, "
                        "or the scale of the prior is wrong",
                        apart, there, cure));
  }
  if (std::min(apart, there) < kLeastApart) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "the two points are %.2f m apart: take two that are %.0f m apart or more, best at far ends",
        std::min(apart, there), kLeastApart));
  }
  PriorPose pose;
  pose.scale = scale;
  pose.yaw = std::atan2(at_site.y(), at_site.x()) - std::atan2(in_prior.y(), in_prior.x());
  pose.yaw = std::remainder(pose.yaw, 2 * M_PI);
  pose.translation = (a.site + b.site) / 2 - pose.ToModel((a.prior + b.prior) / 2);
  return pose;
}

}  // namespace vantage::site_prior
