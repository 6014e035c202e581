#include "tests/core/registration/align/pcl_icp.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

namespace vantage::registration {

Eigen::Isometry3d AlignByPcl(const model::PlanningView& model,
                             std::span<const SurfaceSample> samples,
                             const Eigen::Isometry3d& T_world_scan, double max_correspondence) {
  using Cloud = pcl::PointCloud<pcl::PointNormal>;
  const auto put = [](Cloud& cloud, const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
    pcl::PointNormal p;
    p.x = point.x();
    p.y = point.y();
    p.z = point.z();
    p.normal_x = normal.x();
    p.normal_y = normal.y();
    p.normal_z = normal.z();
    cloud.push_back(p);
  };
  const Cloud::Ptr source(new Cloud);
  const Cloud::Ptr target(new Cloud);
  for (const SurfaceSample& s : samples) put(*source, s.point, s.normal);
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state == model::VoxelState::kTrueSurface) put(*target, voxel.centroid, voxel.normal);
      });
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(source);
  icp.setInputTarget(target);
  icp.setMaxCorrespondenceDistance(max_correspondence);
  icp.setMaximumIterations(60);
  icp.setTransformationEpsilon(1e-12);
  icp.setEuclideanFitnessEpsilon(1e-12);
  Cloud aligned;
  icp.align(aligned, T_world_scan.matrix().cast<float>());
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  const Eigen::Matrix4d m = icp.getFinalTransformation().cast<double>();
  result.linear() =
      Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>())).normalized().toRotationMatrix();
  result.translation() = m.topRightCorner<3, 1>();
  return result;
}

}  // namespace vantage::registration
