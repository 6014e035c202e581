// Aligning a scan of which nothing is known beforehand (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_ANYWHERE_H_
#define VANTAGE_CORE_REGISTRATION_ANYWHERE_H_

#include <Eigen/Geometry>

#include "absl/status/statusor.h"
#include "core/registration/registration.h"

namespace vantage {

// As Register(), where nothing is known of the pose but that the scanner stood upright: looks all
// over the model, and around where the scanner stood last (`T_world_last`). Says in the verdict
// when it cannot tell: rooms that look alike, a site too large to search, too little in common.
absl::StatusOr<RegistrationResult> RegisterAnywhere(const PlanningView& model, const Scan& scan,
                                                    const Eigen::Isometry3d& T_world_last,
                                                    const RegistrationConfig& config,
                                                    Parallel& parallel);

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_ANYWHERE_H_
