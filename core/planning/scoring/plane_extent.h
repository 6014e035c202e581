// Whether an alignment would find the plane around a voxel in a scan from some view (algorithm.md
// section 9, 'Prediction').
#ifndef VANTAGE_CORE_PLANNING_SCORING_PLANE_EXTENT_H_
#define VANTAGE_CORE_PLANNING_SCORING_PLANE_EXTENT_H_

#include <Eigen/Core>

#include "core/model/view/planning_view.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Whether the surface around a voxel of true surface is a plane: the voxel and its neighbours, as
// many as a plane through it has at least. Voxels on edges have normals of either side or of
// neither.
bool LiesInPlane(const model::PlanningView& model, const model::VoxelIndex& v,
                 const model::SurfaceVoxel& surface);

// How far the plane around a voxel goes on, along two directions in it at right angles.
struct PlaneExtent {
  Eigen::Vector3f level = Eigen::Vector3f::UnitX();   // unit, horizontal
  Eigen::Vector3f upward = Eigen::Vector3f::UnitZ();  // unit; of a floor horizontal, too
  float along_level = 0;                              // m, whole voxels
  float along_upward = 0;                             // m, whole voxels
};

// Goes from the voxel of `surface` as far as true surface goes on in its plane; 0.6 m to either
// side at most.
PlaneExtent ExtentOfPlane(const model::PlanningView& model, const model::SurfaceVoxel& surface);

// Whether a scan has samples enough on the plane, both ways, for an alignment to find its normal.
// `ray`: from the view to the voxel, m.
bool FindsPlane(const PlaneExtent& extent, const Eigen::Vector3f& ray,
                const sensor::ScannerModel& scanner);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_PLANE_EXTENT_H_
