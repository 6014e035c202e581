// Priors of a scene, as somebody might have them before the first scan.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_SCENE_PRIOR_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_SCENE_PRIOR_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "client/simulated_job/site.h"
#include "core/site_prior/floor_plan.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/prior_pose.h"
#include "vantage/v1/site_prior.pb.h"

namespace vantage::simulated_job {

enum class ScenePriorKind {
  kTrue,   // the scene's own mesh, 1.5 % too large, as a tablet's drifts
  kPlan,   // its floor plan: walls as they are over most furniture, and nothing else
  kWrong,  // its mesh turned by half a turn about its middle: another flat of the same size
};

// In a frame of its own. INVALID_ARGUMENT: the scene has no plan.
absl::StatusOr<site_prior::PriorMesh> MakeScenePrior(const Site& site, ScenePriorKind kind);

// The walls of a scene at a height over its floor, as a raster in its own frame.
site_prior::PlanRaster PlanOfScene(const Site& site);

// Two points 6 m apart around the start as somebody takes them: up to 0.45 m off each on both axes
// of the plan. `T_world_scene`: the truth.
std::array<site_prior::PlacedPoint, 2> RoughPoints(const Eigen::Vector3d& start, double floor,
                                                   ScenePriorKind kind,
                                                   const Eigen::Isometry3d& T_world_scene,
                                                   uint64_t seed);

// The same as somebody sends it: a mesh as OBJ, the plan as a picture (PNG) with its scale. Without
// the name of the session.
absl::StatusOr<v1::SetSitePriorRequest> SitePriorRequestOf(const Site& site, ScenePriorKind kind,
                                                           const Eigen::Isometry3d& T_world_scene,
                                                           uint64_t seed);

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_SCENE_PRIOR_H_
