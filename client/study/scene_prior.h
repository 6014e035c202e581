// Priors of a scene, as somebody might have them before the first scan.
#ifndef VANTAGE_CLIENT_STUDY_SCENE_PRIOR_H_
#define VANTAGE_CLIENT_STUDY_SCENE_PRIOR_H_

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "client/simulated_job/site.h"
#include "core/site_prior/floor_plan.h"
#include "core/site_prior/prior_mesh.h"
#include "core/site_prior/prior_pose.h"

namespace vantage::study {

enum class ScenePriorKind {
  kTrue,   // the scene's own mesh, 1.5 % too large, as a tablet's drifts
  kPlan,   // its floor plan: walls as they are over most furniture, and nothing else
  kWrong,  // its mesh turned by half a turn about its middle: another flat of the same size
};

// In a frame of its own. INVALID_ARGUMENT: the scene has no plan.
absl::StatusOr<site_prior::PriorMesh> MakeScenePrior(const simulated_job::Site& site,
                                                     ScenePriorKind kind);

// The walls of a scene at a height over its floor, as a raster in its own frame.
site_prior::PlanRaster PlanOfScene(const simulated_job::Site& site);

// Two points 6 m apart around the start as somebody takes them: up to 0.45 m off each on both axes of
// the plan.
// `T_world_scene`: the truth.
std::array<site_prior::PlacedPoint, 2> RoughPoints(const Eigen::Vector3d& start, double floor,
                                                   ScenePriorKind kind,
                                                   const Eigen::Isometry3d& T_world_scene,
                                                   uint64_t seed);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_SCENE_PRIOR_H_
