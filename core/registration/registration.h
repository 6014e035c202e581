// Aligning a scan to the model and qualifying the result (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_REGISTRATION_H_
#define VANTAGE_CORE_REGISTRATION_REGISTRATION_H_

#include <span>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// Aligns `scan` to `model` starting from `prior` and qualifies the outcome.
// INVALID_ARGUMENT: the image or prior is not valid. FAILED_PRECONDITION: the model has no true
// surface. A bad alignment is no error: the verdict says so.
absl::StatusOr<RegistrationResult> Register(const model::PlanningView& model,
                                            const sensor::Scan& scan,
                                            const sensor::PosePrior& prior,
                                            const RegistrationConfig& config,
                                            parallel::Parallel& parallel);

// Register() with targets beside the prior. INVALID_ARGUMENT names the target that is not valid.
absl::StatusOr<RegistrationResult> RegisterWithTargets(const model::PlanningView& model,
                                                       const sensor::Scan& scan,
                                                       const sensor::PosePrior& prior,
                                                       std::span<const TargetTie> targets,
                                                       const RegistrationConfig& config,
                                                       parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_REGISTRATION_H_
