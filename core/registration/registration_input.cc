#include "core/registration/registration_input.h"

#include <Eigen/Cholesky>

namespace vantage::registration {
namespace {

absl::Status ValidatePrior(const sensor::PosePrior& prior) {
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
    const sensor::Matrix6d& c = *prior.covariance;
    if (!c.allFinite() || !c.isApprox(c.transpose(), 1e-9) ||
        Eigen::LLT<sensor::Matrix6d>(c).info() != Eigen::Success) {
      return absl::InvalidArgumentError(
          "pose prior: covariance must be finite, symmetric and positive definite");
    }
    constexpr double kLeastVariance = 1e-16;  // rad^2, m^2; nobody knows better
    if (!(c.diagonal().minCoeff() >= kLeastVariance)) {
      return absl::InvalidArgumentError(
          "pose prior: covariance needs variances of at least 1e-16 rad^2 and m^2");
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

}  // namespace

absl::Status ValidateRegistration(const model::PlanningView& model, const sensor::Scan& scan,
                                  const sensor::PosePrior& prior,
                                  const RegistrationConfig& config) {
  if (absl::Status status = config.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.scanner.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.image.Validate(); !status.ok()) return status;
  if (absl::Status status = ValidatePrior(prior); !status.ok()) return status;
  for (const model::BrickAt& at : model.surface_bricks()) {
    if (at.contents->surface.empty()) continue;
    for (const model::VoxelState state : at.contents->state) {
      if (state == model::VoxelState::kTrueSurface) return absl::OkStatus();
    }
  }
  return absl::FailedPreconditionError(
      "the model has no true surface to align to; insert a first scan");
}

}  // namespace vantage::registration
