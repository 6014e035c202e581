// What rays are stopped by, as bricks that are walked through voxel by voxel.
#ifndef VANTAGE_CORE_VISIBILITY_BRICK_GEOMETRY_H_
#define VANTAGE_CORE_VISIBILITY_BRICK_GEOMETRY_H_

#include <embree3/rtcore.h>

#include <cstddef>
#include <vector>

#include "core/model/view/brick_mask.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// A brick that a ray from empty space can enter opaque voxels of.
struct OpaqueBrick {
  const model::BrickMask* opaque;  // of the model's page, or null: all of it
  Eigen::Vector3i corner;          // scene coordinates
};

// In the order of pages (z, y, x), and in a page of its bricks. Bricks of nothing but opaque voxels
// are among them where a neighbour has empty ones. Incomplete when cancelled.
std::vector<OpaqueBrick> FindOpaqueBricks(const OpaqueGrid& grid, parallel::Parallel& parallel,
                                          const parallel::Cancellation& cancelled);

// Of bricks that outlive it. The caller releases it. Rays of a packet have one origin.
RTCGeometry BrickGeometry(RTCDevice device, const std::vector<OpaqueBrick>& bricks);

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_BRICK_GEOMETRY_H_
