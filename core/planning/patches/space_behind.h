// Unknown space behind false surface: a view near an opening gains more than the opening's own
// surface (ours, not in the paper; algorithm.md section 5, 'What a sample is worth').
#ifndef VANTAGE_CORE_PLANNING_PATCHES_SPACE_BEHIND_H_
#define VANTAGE_CORE_PLANNING_PATCHES_SPACE_BEHIND_H_

#include <Eigen/Core>

#include "core/model/view/planning_view.h"

namespace vantage::planning {

// Depth of unknown space behind a false surface voxel, m: along `-normal` from its centre to the
// first voxel that is known (surface or empty), or to the model's bounds; at most `limit`.
double DepthBehind(const model::PlanningView& model, const model::VoxelIndex& voxel,
                   const Eigen::Vector3f& normal, double limit);

// The sampling density at an opening up to which samples count, samples / m^2: D (1 + depth / r)^2.
// Samples through the opening land on surface `depth` behind it, which is then at the required
// density D; r is the range from which openings are looked through.
double DensityWorthHaving(double required_density, double depth);

// The depth behind an opening at which `density` is worth having, m: DensityWorthHaving() the other
// way round, to a tenth of a millimetre.
double DepthWorth(double required_density, double density);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_SPACE_BEHIND_H_
