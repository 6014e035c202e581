// The verdict on an alignment that was made (algorithm.md section 9, 'The verdict on an
// alignment').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_QUALIFY_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_QUALIFY_H_

#include <span>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/align.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/pose_prior.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

struct Qualification {
  RegistrationResult result;
  // Where the overlap's shape leaves directions open: the change of the pose, about the overlap's
  // centroid, that takes the pose back to the prior in these directions. Else zero.
  sensor::Vector6d to_prior = sensor::Vector6d::Zero();
  sensor::Matrix6d open =
      sensor::Matrix6d::Zero();  // information that would close those directions
};

// Weighs overlap, residuals, covariance with correlated errors, contradiction with known-empty
// space and rival minima at the alignment's pose. With `scan`, the one whose surface that is,
// things that were moved since are told apart from contradiction: for scans about whose place
// something is known.
Qualification Qualify(const model::PlanningView& model, const ScanSurface& surface,
                      const Alignment& alignment, const sensor::PosePrior& prior,
                      const RegistrationConfig& config, parallel::Parallel& parallel,
                      std::span<const TargetTie> targets = {}, const sensor::Scan* scan = nullptr);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_QUALIFY_H_
