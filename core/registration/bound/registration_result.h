// What became of aligning a scan (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_REGISTRATION_RESULT_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_REGISTRATION_RESULT_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/registration/align/instrument_residuals.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// Another pose at which a scan fits, and that nothing known refutes.
struct RivalPose {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double fit_share = 0;  // of what fits at the aligned pose; up to 2 for a pose that gave way
  double distance = 0;   // m, between the scanner's places
  double farthest = 0;   // m, between where either puts a piece of the scan's surface, at most
};

// An alignment and its evidence.
struct RegistrationResult {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  bool converged = false;
  int iterations = 0;
  size_t correspondences = 0;
  double rms_residual = 0;         // m, point to plane, of the inliers
  double expected_residual = 0;    // m, what the noise explains
  double contradiction_share = 0;  // of the samples: in known-empty space, or behind walls
  // m2, about, of the scan's surface that contradicts, where so much does that it would make a
  // doubt, and it is taken for things that were moved between the scans (bound/moved_things.h).
  std::optional<double> moved_area;
  sensor::Matrix6d covariance =
      sensor::Matrix6d::Zero();  // [rotation about world axes; translation], about the
                                 // overlap's centroid
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  // of the overlap, m, world
  // What its residuals tell of the instrument; absent where the pose is in doubt for anything but
  // these, or the shape of the overlap leaves it open.
  std::optional<PairResiduals> residuals;
  double seconds = 0;
  RegistrationVerdict verdict;
  // Where the scan may have been made instead, the best fit first; empty unless the verdict rests
  // on that (RegistrationBasis::kRivalPose is among its reasons).
  std::vector<RivalPose> rival_poses;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_REGISTRATION_RESULT_H_
