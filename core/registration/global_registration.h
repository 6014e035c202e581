// Aligning a scan of which nothing is known beforehand (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_GLOBAL_REGISTRATION_H_
#define VANTAGE_CORE_REGISTRATION_GLOBAL_REGISTRATION_H_

#include <Eigen/Geometry>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// As Register(), where nothing is known of the pose but that the scanner stood upright: looks all
// over the model, and around where the scanner stood last (`T_world_last`). Says in the verdict
// when it cannot tell: rooms that look alike, a site too large to search, too little in common.
absl::StatusOr<RegistrationResult> RegisterGlobally(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& T_world_last,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GLOBAL_REGISTRATION_H_
