#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <chrono>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/align.h"
#include "core/registration/qualify.h"
#include "core/registration/registration.h"
#include "core/registration/scan_surface.h"

namespace vantage {
namespace {

absl::Status ValidatePrior(const PosePrior& prior) {
  const Eigen::Isometry3d& pose = prior.T_world_scan;
  if (!pose.matrix().allFinite()) {
    return absl::InvalidArgumentError("pose prior: rotation and translation must be finite");
  }
  const Eigen::Matrix3d rotation = pose.linear();
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0) {
    return absl::InvalidArgumentError(
        "pose prior: not a rigid transform; give a unit quaternion (w, x, y, z)");
  }
  if (prior.covariance.has_value()) {
    const Matrix6d& c = *prior.covariance;
    if (!c.allFinite() || !c.isApprox(c.transpose(), 1e-9) ||
        Eigen::LLT<Matrix6d>(c).info() != Eigen::Success) {
      return absl::InvalidArgumentError(
          "pose prior: covariance must be finite, symmetric and positive definite");
    }
  }
  if (prior.levelled_sigma.has_value() &&
      !(*prior.levelled_sigma > 0 && *prior.levelled_sigma <= 0.2)) {
    return absl::InvalidArgumentError("pose prior: levelled_sigma must be in (0, 0.2] rad");
  }
  if (prior.trusted && !prior.covariance.has_value()) {
    return absl::InvalidArgumentError("pose prior: a trusted pose needs a covariance");
  }
  return absl::OkStatus();
}

// The change from the trusted to the aligned pose, against what both leave open: chi-square of six
// degrees of freedom.
double Disagreement(const PosePrior& trusted, const RegistrationResult& aligned) {
  const Eigen::Isometry3d& from = trusted.T_world_scan;
  const Eigen::Matrix3d turn = aligned.T_world_scan.linear() * from.linear().transpose();
  const Eigen::AngleAxisd rotation(turn);
  Vector6d change;
  change << rotation.angle() * rotation.axis(),
      aligned.T_world_scan.translation() - from.translation();
  // The alignment's covariance is about the overlap's centroid: move it to the scanner.
  const Eigen::Vector3d arm = from.translation() - aligned.centroid;
  Matrix6d move = Matrix6d::Identity();
  move.bottomLeftCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  const Matrix6d covariance = move * aligned.covariance * move.transpose() + *trusted.covariance;
  return change.dot(covariance.ldlt().solve(change));
}

}  // namespace

absl::StatusOr<RegistrationResult> Register(const PlanningView& model, const Scan& scan,
                                            const PosePrior& prior,
                                            const RegistrationConfig& config, Parallel& parallel) {
  const auto started = std::chrono::steady_clock::now();
  if (absl::Status status = config.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.scanner.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.image.Validate(); !status.ok()) return status;
  if (absl::Status status = ValidatePrior(prior); !status.ok()) return status;
  bool any_surface = false;
  for (const PlanningView::BrickAt& at : model.bricks()) {
    for (const VoxelState state : at.contents->state) {
      any_surface = any_surface || state == VoxelState::kTrueSurface;
    }
    if (any_surface) break;
  }
  if (!any_surface) {
    return absl::FailedPreconditionError(
        "the model has no true surface to align to; insert a first scan");
  }

  const ScanSurface surface = SampleSurface(scan, config.sample_spacing, parallel);
  Alignment alignment = Align(model, surface, prior, config, parallel);
  RegistrationResult result;
  if (prior.trusted) {
    // Align on the scan's own evidence, compare, and keep the trusted pose.
    PosePrior guess = prior;
    guess.trusted = false;
    guess.covariance.reset();
    const RegistrationResult aligned = Qualify(model, surface, alignment, guess, config);
    const bool checkable = aligned.correspondences > 0 && aligned.converged;
    Alignment kept = alignment;
    kept.T_world_scan = prior.T_world_scan;
    kept.converged = true;
    kept.rivals.clear();  // the pose was not chosen among minima
    result = Qualify(model, surface, kept, prior, config);
    constexpr double kChiSquare6At999 = 22.46;
    if (checkable && Disagreement(prior, aligned) > kChiSquare6At999 &&
        aligned.verdict.overlap_share >= config.minimum_overlap) {
      const double shift =
          (aligned.T_world_scan.translation() - prior.T_world_scan.translation()).norm();
      result.verdict.outcome = RegistrationOutcome::kDoubtful;
      result.verdict.decided_by = "trusted pose";
      result.verdict.reason = absl::StrFormat(
          "the surfaces fit %.3f m away from the trusted pose, more than its covariance allows",
          shift);
      result.verdict.remedy = "check the control registration, or give its covariance as it is";
    }
  } else {
    result = Qualify(model, surface, alignment, prior, config);
  }
  result.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace vantage
