// What lies between a box of views and a box of targets: nothing at all, or something that hides
// every target from every view (algorithm.md section 8, 'Visibility of a shaft').
#ifndef VANTAGE_CORE_VISIBILITY_SHAFT_H_
#define VANTAGE_CORE_VISIBILITY_SHAFT_H_

#include <Eigen/Geometry>

#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// Boxes in scene coordinates (voxels from the grid's corner), possibly a single point; their
// middles lie in the grid, outside of which all is opaque. kAll and true are certain; the other
// answers prove nothing. Touching an opaque voxel counts as meeting it, and boxes are taken 0.001
// voxels larger, so that rays traced in floats agree.

// kAll: every segment from a view to a target meets an opaque voxel, since some layer of voxels
// between the boxes is opaque wherever a segment can cross its middle plane. kNone: the segment
// between the boxes' middles meets nothing in any such layer, so that they are not hidden.
enum class Hidden { kNone, kMaybe, kAll };
Hidden Occlusion(const OpaqueGrid& grid, const Eigen::AlignedBox3d& views,
                 const Eigen::AlignedBox3d& targets);

// No opaque voxel meets the convex hull of the boxes. Exact.
bool EntirelyVisible(const OpaqueGrid& grid, const Eigen::AlignedBox3d& views,
                     const Eigen::AlignedBox3d& targets);

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_SHAFT_H_
