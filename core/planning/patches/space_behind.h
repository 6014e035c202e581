// What lies behind false surface, as far as the model can tell: a view near an opening gains more
// than the opening (beyond the paper).
#ifndef VANTAGE_CORE_PLANNING_PATCHES_SPACE_BEHIND_H_
#define VANTAGE_CORE_PLANNING_PATCHES_SPACE_BEHIND_H_

#include <Eigen/Core>

#include "core/model/view/planning_view.h"

namespace vantage::planning {

// How far the unknown goes on behind a false surface voxel, m: along `-normal` from its centre to
// what is known, surface or empty, or to the end of the model's bounds; at most `limit`.
double DepthBehind(const model::PlanningView& model, const model::VoxelIndex& voxel,
                   const Eigen::Vector3f& normal, double limit);

// The sampling density at an opening that is worth having: samples through it land on surface
// `depth` behind, which is at the required density D when there are D (1 + depth / r)^2 at the
// opening, r being the range from which openings are looked through.
double DensityWorthHaving(double required_density, double depth);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_SPACE_BEHIND_H_
