// A prior as voxels of the model: its surface, and the space in its rooms (algorithm.md section 13,
// 'Rooms').
#ifndef VANTAGE_CORE_SITE_PRIOR_PRIOR_SPACE_H_
#define VANTAGE_CORE_SITE_PRIOR_PRIOR_SPACE_H_

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/prior_pose.h"

namespace vantage::site_prior {

// The most of a prior, in voxels of a model: 10,000 m2 of surface and 16,000 m3 of rooms in voxels
// of 5 cm, some 160 MB of each. Points on its triangles, at half a voxel, take some seconds.
inline constexpr double kMostSurfaceVoxels = 4e6;
inline constexpr size_t kMostPriorBricks = 250'000;
inline constexpr double kMostPriorSamples = 1e8;

// What SpaceOf() takes at most while it is at work, bytes, whatever it answers.
uint64_t EstimateSpaceMemory(const PriorMesh& mesh, double scale, double voxel);

// What a prior's space holds, bytes.
uint64_t BytesOf(const model::PlanningView& space);

// INVALID_ARGUMENT: it lies farther off than voxels are counted.
absl::Status CheckPlace(const PriorMesh& mesh, const PriorPose& pose, double voxel);

// Rooms are empty: what lies over floor with headroom, and what hangs together with that under
// furniture. Surface beside them is true surface at no density that faces them. All else is
// unknown: slabs, the inside of furniture, what is outside. No stations. INVALID_ARGUMENT: it has
// no room, CheckPlace(), or its triangles are so long that it takes
// more than kMostPriorSamples. RESOURCE_EXHAUSTED: more surface or rooms than the bounds. CANCELLED
// when that was requested on the way.
absl::StatusOr<model::PlanningView> SpaceOf(const PriorMesh& mesh, const PriorPose& pose,
                                            double voxel,
                                            const parallel::Cancellation& cancelled = {});

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_PRIOR_SPACE_H_
