// A piece of deficient surface (algorithm.md section 7).
#ifndef VANTAGE_CORE_PLANNING_PLAN_PATCH_H_
#define VANTAGE_CORE_PLANNING_PLAN_PATCH_H_

#include <Eigen/Core>

#include "core/model/view/voxel.h"
#include "core/planning/plan/cell_range.h"

namespace vantage::planning {

// A planar group of deficient voxels of one kind (algorithm.md section 7B).
struct Patch {
  model::SurfaceKind kind = model::SurfaceKind::kTrue;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   // m, of the bounding rectangle
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit
  Eigen::Vector3d axis_u = Eigen::Vector3d::UnitX();  // unit, along the rectangle's longer side
  double length_u = 0;                                // m, full sides of the rectangle
  double length_v = 0;
  double area = 0;          // m^2, sum over its cells
  double mean_density = 0;  // mean q, samples / m^2
  double deficit = 0;       // lacking samples: (D - mean q) * area, and those for space behind it
  double importance = 0;    // w * deficit, each sample by what it counts where it lies
  CellRange cells;          // of PatchSet::cells
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_PATCH_H_
