// PCL's own point-to-plane ICP on the same samples and the same voxel centroids: the reference for
// accuracy and speed.
#ifndef VANTAGE_TESTS_CORE_REGISTRATION_ALIGN_PCL_ICP_H_
#define VANTAGE_TESTS_CORE_REGISTRATION_ALIGN_PCL_ICP_H_

#include <Eigen/Geometry>
#include <span>

#include "core/model/view/planning_view.h"
#include "core/registration/align/scan_surface.h"

namespace vantage::registration {

// pcl::IterativeClosestPointWithNormals from `T_world_scan`, correspondences up to
// `max_correspondence` m.
Eigen::Isometry3d AlignByPcl(const model::PlanningView& model,
                             std::span<const SurfaceSample> samples,
                             const Eigen::Isometry3d& T_world_scan, double max_correspondence);

}  // namespace vantage::registration

#endif  // VANTAGE_TESTS_CORE_REGISTRATION_ALIGN_PCL_ICP_H_
