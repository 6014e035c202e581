// Where a ray to a surface voxel aims (algorithm.md section 8, 'Targets').
#ifndef VANTAGE_CORE_MODEL_VIEW_TARGET_DISTANCES_H_
#define VANTAGE_CORE_MODEL_VIEW_TARGET_DISTANCES_H_

#include <array>

namespace vantage::model {

// In voxels, along the normal from the middle of the voxel: the first that is empty is aimed at.
// Planning aims there, and the model asks what scans saw there.
inline constexpr std::array<double, 3> kTargetDistances = {1.45, 1.95, 2.45};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_TARGET_DISTANCES_H_
