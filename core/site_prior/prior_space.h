// A prior as voxels of the model: its surface, and the space in its rooms (algorithm.md section 13,
// 'Rooms').
#ifndef VANTAGE_CORE_SITE_PRIOR_PRIOR_SPACE_H_
#define VANTAGE_CORE_SITE_PRIOR_PRIOR_SPACE_H_

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/prior_pose.h"

namespace vantage::site_prior {

// Rooms are empty: what lies over floor with headroom, and what hangs together with that under
// furniture. Surface beside them is true surface at no density that faces them. All else is
// unknown: slabs, the inside of furniture, what is outside. No stations. INVALID_ARGUMENT: it has
// no room. RESOURCE_EXHAUSTED: more surface or space than kMostVoxels. CANCELLED when that was
// requested on the way.
inline constexpr double kMostVoxels = 4e8;
absl::StatusOr<model::PlanningView> SpaceOf(const PriorMesh& mesh, const PriorPose& pose,
                                            double voxel,
                                            const parallel::Cancellation& cancelled = {});

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_PRIOR_SPACE_H_
