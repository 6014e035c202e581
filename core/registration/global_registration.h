// Aligning a scan of which nothing is known beforehand (algorithm.md section 9, 'Global
// registration').
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

// As Register(), where nothing is known of the pose but that the scanner stood upright. Searches
// all of the model, and the surroundings of where the scanner stood last (`T_world_last`). The
// verdict says when the place cannot be told: rooms look alike, the site is too large to search, or
// too little is in common.
absl::StatusOr<RegistrationResult> RegisterGlobally(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& T_world_last,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GLOBAL_REGISTRATION_H_
