// The verdict on an alignment that was made (algorithm.md section 9, last paragraph).
#ifndef VANTAGE_CORE_REGISTRATION_QUALIFY_H_
#define VANTAGE_CORE_REGISTRATION_QUALIFY_H_

#include <span>

#include "core/model/planning_view.h"
#include "core/registration/align.h"
#include "core/registration/registration.h"
#include "core/registration/scan_surface.h"
#include "core/registration/targets.h"

namespace vantage {

// Weighs overlap, residuals, covariance with correlated errors, contradiction with known-empty
// space and rival minima at the alignment's pose.
RegistrationResult Qualify(const PlanningView& model, const ScanSurface& surface,
                           const Alignment& alignment, const PosePrior& prior,
                           const RegistrationConfig& config,
                           std::span<const TargetTie> targets = {});

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_QUALIFY_H_
