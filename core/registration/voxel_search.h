// From a sample to the piece of the model's true surface that it lies on, in the voxels themselves.
#ifndef VANTAGE_CORE_REGISTRATION_VOXEL_SEARCH_H_
#define VANTAGE_CORE_REGISTRATION_VOXEL_SEARCH_H_

#include <Eigen/Core>

#include "core/model/planning_view.h"
#include "core/registration/scan_surface.h"

namespace vantage {

// Voxels from a sample to a voxel's centroid.
inline constexpr double kFineReach = 1.6;

struct Match {
  const SurfaceVoxel* voxel = nullptr;
  Eigen::Vector3d normal;  // mean of the sample's and the voxel's
};

class VoxelSearch {
 public:
  VoxelSearch(const PlanningView& model, double reach_voxels)
      : model_(model), reach_(reach_voxels * model.voxel_size()) {}

  // The nearest compatible true-surface voxel by its centroid.
  Match Find(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;

 private:
  const PlanningView& model_;
  double reach_;
};

// Variance of a residual before any of it is seen, m^2. `gap`: from the voxel's centroid to the
// sample, `along` of it along the normal.
double ResidualVariance(const SurfaceSample& sample, const SurfaceVoxel& voxel,
                        const Eigen::Vector3d& gap, double along, double roughness,
                        double normal_sigma);

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_VOXEL_SEARCH_H_
