#include "core/registration/voxel_search.h"

#include <algorithm>

namespace vantage {
namespace {

constexpr double kFineCompatible = 0.80;  // cosine between normals

}  // namespace

Match VoxelSearch::Find(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
  Match best;
  const double h = model_.voxel_size();
  const VoxelIndex low = model_.At(point - Eigen::Vector3d::Constant(reach_));
  const VoxelIndex high = model_.At(point + Eigen::Vector3d::Constant(reach_));
  double nearest = reach_ * reach_;
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const VoxelIndex v(x, y, z);
        const Eigen::Array3d corner = v.cast<double>().array() * h;
        const Eigen::Array3d outside =
            (corner - point.array()).max(point.array() - corner - h).max(0.0);
        if (outside.square().sum() >= nearest) continue;
        if (model_.State(v) != VoxelState::kTrueSurface) continue;
        const SurfaceVoxel* voxel = model_.Surface(v);
        const Eigen::Vector3d voxel_normal = voxel->normal.cast<double>();
        if (voxel_normal.dot(normal) < kFineCompatible) continue;
        const double distance = (point - voxel->centroid.cast<double>()).squaredNorm();
        if (distance >= nearest) continue;
        nearest = distance;
        best.voxel = voxel;
      }
    }
  }
  if (best.voxel != nullptr) {
    best.normal = (best.voxel->normal.cast<double>() + normal).normalized();
  }
  return best;
}

double ResidualVariance(const SurfaceSample& sample, const SurfaceVoxel& voxel,
                        const Eigen::Vector3d& gap, double along, double roughness,
                        double normal_sigma) {
  const double noise = std::max<double>(sample.sigma, roughness);
  const double model = noise * noise / std::max<double>(1.0, voxel.samples);
  const double interpolated = voxel.samples == 0 ? noise * noise : 0.0;
  const double across = gap.squaredNorm() - along * along;  // m^2, off the centroid in its plane
  return noise * noise + model + interpolated +
         0.5 * normal_sigma * normal_sigma * std::max(0.0, across);
}

}  // namespace vantage
