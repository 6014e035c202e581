// What a patch cell gains from *every* pose at which a person may set up when aiming at a view
// (algorithm.md section 8, 'Pose-error sensitivity').
#ifndef VANTAGE_CORE_PLANNING_SCORING_POSE_SENSITIVITY_H_
#define VANTAGE_CORE_PLANNING_SCORING_POSE_SENSITIVITY_H_

#include <Eigen/Geometry>
#include <utility>

#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/interval_constraints.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// The reference is kept. Thread safe.
class PoseSensitivity {
 public:
  // `grid` is summed. `reach` (m, per axis): half a viewcell and the positioning error. `corner`:
  // of the scene, in voxels; `voxel` in m.
  PoseSensitivity(const SensingConstraints& constraints, visibility::OpaqueGrid grid, double reach,
                  double voxel, const Eigen::Vector3d& corner)
      : constraints_(constraints),
        intervals_(constraints),
        grid_(std::move(grid)),
        reach_(reach),
        voxel_(voxel),
        corner_(corner) {}

  // Score of cell `at` with the lower bound of the density over the box of half side `reach` around
  // the view, or 0 where a constraint may be violated or the target hidden from somewhere in it.
  float CellScore(const Eigen::Vector3d& view, const CellArrays& cells, size_t at) const;

  double reach() const { return reach_; }

 private:
  const SensingConstraints& constraints_;
  IntervalConstraints intervals_;
  visibility::OpaqueGrid grid_;
  double reach_;
  double voxel_;
  Eigen::Vector3d corner_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_POSE_SENSITIVITY_H_
