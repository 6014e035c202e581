// Where a prior lies in the model: upright, with a scale.
#ifndef VANTAGE_CORE_SITE_PRIOR_PRIOR_POSE_H_
#define VANTAGE_CORE_SITE_PRIOR_PRIOR_POSE_H_

#include <Eigen/Core>
#include <array>

#include "absl/status/statusor.h"

namespace vantage::site_prior {

// p_model = translation + scale R_z(yaw) p_prior.
struct PriorPose {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // m
  double yaw = 0;                                         // rad, about z
  double scale = 1;

  Eigen::Vector3d ToModel(const Eigen::Vector3d& p) const;
  Eigen::Vector3d ToPrior(const Eigen::Vector3d& p) const;
};

// One place, in the prior and at the site.
struct PlacedPoint {
  Eigen::Vector3d prior = Eigen::Vector3d::Zero();  // m, prior's frame
  Eigen::Vector3d site = Eigen::Vector3d::Zero();   // m, model frame
};

// By two points, each a metre or so off: their middles and their direction in plan, and the mean of
// their heights. `scale`: of the prior, where it is known to be another than 1. INVALID_ARGUMENT:
// they are less than kLeastApart apart, or their distances contradict each other by more than such
// points do: the unit is wrong, or one of them.
inline constexpr double kLeastApart = 1.0;  // m, in plan
absl::StatusOr<PriorPose> PlaceByPoints(const std::array<PlacedPoint, 2>& points, double scale = 1);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_PRIOR_POSE_H_
