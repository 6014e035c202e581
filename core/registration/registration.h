// Aligning a scan to the model, qualifying the result, and predicting it for a view not yet scanned
// (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_REGISTRATION_H_
#define VANTAGE_CORE_REGISTRATION_REGISTRATION_H_

#include <Eigen/Geometry>

#include "absl/status/statusor.h"
#include "core/model/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/verdict.h"
#include "core/sensor/scan.h"

namespace vantage {

// An alignment and its evidence.
struct RegistrationResult {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  bool converged = false;
  int iterations = 0;
  size_t correspondences = 0;
  double rms_residual = 0;         // m, point to plane, of the inliers
  double expected_residual = 0;    // m, what the noise explains
  double contradiction_share = 0;  // of the samples: behind known-empty space (they see through it)
  Matrix6d covariance = Matrix6d::Zero();  // [rotation about world axes; translation], about the
                                           // overlap's centroid
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  // of the overlap, m, world
  double seconds = 0;
  RegistrationVerdict verdict;
};

// Aligns `scan` to `model` starting from `prior` and qualifies the outcome.
// INVALID_ARGUMENT: the image or prior is not valid. FAILED_PRECONDITION: the model has no true
// surface. A bad alignment is no error: the verdict says so.
absl::StatusOr<RegistrationResult> Register(const PlanningView& model, const Scan& scan,
                                            const PosePrior& prior,
                                            const RegistrationConfig& config, Parallel& parallel);

// Levels the first scan of a session: the rotation that turns its floor's normal to +z, found from
// the largest upward-facing horizontal plane within 15 degrees of level (or from the prior's
// inclinometer, which then stands). Identity rotation where there is no floor to see.
struct Levelling {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double tilt = 0;  // rad, that was taken out
  bool from_inclinometer = false;
  bool found_floor = false;
};
absl::StatusOr<Levelling> LevelFirstScan(const Scan& scan);

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_REGISTRATION_H_
