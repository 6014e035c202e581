// Registers a scan whether or not anything is known of where it was taken.
#ifndef VANTAGE_CORE_REGISTRATION_PLACE_AND_REGISTER_H_
#define VANTAGE_CORE_REGISTRATION_PLACE_AND_REGISTER_H_

#include <Eigen/Geometry>
#include <span>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// The alignment starts from the scan's prior; where it has none, from the pose that its targets
// give; where they give none, from the best of a search of the whole site, which begins at
// `last_pose` (scanner to world frame): that of the scan before. Where a prior that is not trusted
// does not fit, and no targets were seen, that search is tried, too. What it finds elsewhere is
// doubtful, since the scan may have been made where the prior says, in a room that looks like a
// known one: the verdict says how far apart the two are, and other places that look the same are
// rivals. A prior from which the scan registers costs no search. Errors as of RegisterWithTargets()
// and RegisterGlobally().
absl::StatusOr<RegistrationResult> PlaceAndRegister(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& last_pose,
                                                    std::span<const TargetTie> targets,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_PLACE_AND_REGISTER_H_
