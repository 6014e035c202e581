// What a scan can be registered with.
#ifndef VANTAGE_CORE_REGISTRATION_REGISTRATION_INPUT_H_
#define VANTAGE_CORE_REGISTRATION_REGISTRATION_INPUT_H_

#include "absl/status/status.h"
#include "core/model/view/planning_view.h"
#include "core/registration/align/registration_config.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// INVALID_ARGUMENT: the configuration, the scanner, the image or the prior is not valid.
// FAILED_PRECONDITION: the model has no true surface to align to.
absl::Status ValidateRegistration(const model::PlanningView& model, const sensor::Scan& scan,
                                  const sensor::PosePrior& prior, const RegistrationConfig& config);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_REGISTRATION_INPUT_H_
