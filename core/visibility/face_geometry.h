// What rays are stopped by, as rectangles of faces between empty and opaque voxels.
#ifndef VANTAGE_CORE_VISIBILITY_FACE_GEOMETRY_H_
#define VANTAGE_CORE_VISIBILITY_FACE_GEOMETRY_H_

#include <embree3/rtcore.h>

#include <cstddef>

#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::visibility {

// In scene coordinates. `count` is that of the rectangles. Null where there are none, or when
// cancelled on the way; else the caller releases it.
RTCGeometry FaceGeometry(RTCDevice device, const OpaqueGrid& grid, parallel::Parallel& parallel,
                         const parallel::Cancellation& cancelled, size_t& count);

}  // namespace vantage::visibility

#endif  // VANTAGE_CORE_VISIBILITY_FACE_GEOMETRY_H_
