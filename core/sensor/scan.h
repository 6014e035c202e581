// A range image together with what is known of where it was made.
#ifndef VANTAGE_CORE_SENSOR_SCAN_H_
#define VANTAGE_CORE_SENSOR_SCAN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// What is believed of a scan's pose before it is aligned.
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
};

struct Scan {
  RangeImage image;
  ScannerModel scanner;
  std::optional<PosePrior> prior;
};

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCAN_H_
