// What is known of a scan's pose before it is aligned.
#ifndef VANTAGE_CORE_SENSOR_POSE_PRIOR_H_
#define VANTAGE_CORE_SENSOR_POSE_PRIOR_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace vantage::sensor {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

struct PosePrior {
  // Rigid, scanner frame to world (= model) frame, m.
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();

  // Covariance of the pose error [rotation about world axes, rad; translation, m]. Nothing when the
  // pose is a guess.
  std::optional<Matrix6d> covariance;

  // An inclinometer fixed roll and pitch, to within this angle (rad, one sigma).
  std::optional<double> levelled_sigma;

  // A vendor's or control network's registration: checked against the model, never replaced.
  bool trusted = false;

  // It is what the header of the scan's file states, which nobody has looked at. Only words depend
  // on it.
  bool from_file_header = false;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_POSE_PRIOR_H_
