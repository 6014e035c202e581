// The verdict on an alignment that was made (algorithm.md section 9, last paragraph).
#ifndef VANTAGE_CORE_REGISTRATION_QUALIFY_H_
#define VANTAGE_CORE_REGISTRATION_QUALIFY_H_

#include <span>

#include "core/model/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align.h"
#include "core/registration/registration.h"
#include "core/registration/scan_surface.h"
#include "core/registration/targets.h"

namespace vantage {

struct Qualification {
  RegistrationResult result;
  // Where the overlap's shape leaves directions open: the change of the pose, about the overlap's
  // centroid, that takes those back to what the prior has them. Else zero.
  Vector6d to_prior = Vector6d::Zero();
  Matrix6d open = Matrix6d::Zero();  // information that would close those directions
};

// Weighs overlap, residuals, covariance with correlated errors, contradiction with known-empty
// space and rival minima at the alignment's pose.
Qualification Qualify(const PlanningView& model, const ScanSurface& surface,
                      const Alignment& alignment, const PosePrior& prior,
                      const RegistrationConfig& config, Parallel& parallel,
                      std::span<const TargetTie> targets = {});

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_QUALIFY_H_
