// The plane through each surface voxel (algorithm.md section 4, 'Normals and centroids').
#ifndef VANTAGE_CORE_MODEL_MERGE_LOCAL_PLANE_H_
#define VANTAGE_CORE_MODEL_MERGE_LOCAL_PLANE_H_

#include <span>
#include <vector>

#include "core/model/merge/brick_neighbourhood.h"
#include "core/model/merge/merged_brick.h"

namespace vantage::model {

// Fits a plane to the points in the 3 x 3 x 3 voxels around each surface voxel of `brick`, turned
// towards the scanners that measured it. `in_layers`: the brick in each of `layers`, null where it
// says nothing.
std::vector<LocalPlane> FitPlanes(const VoxelIndex& brick,
                                  const BrickNeighbourhood<UnitedBrick>& united,
                                  std::span<const LayerBrick* const> in_layers,
                                  std::span<const ScanLayer* const> layers, double voxel_size);

// Where two surfaces meet, a fit to both is neither: such a voxel takes the flat neighbour's plane
// that its own centroid lies on, if there is one.
std::vector<LocalPlane> SnapToFlatNeighbours(const BrickNeighbourhood<MergedBrick>& fitted,
                                             double voxel_size);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_LOCAL_PLANE_H_
