// Finds the connected returns from behind a plane that are reflections in it (algorithm.md section
// 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTION_REGIONS_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTION_REGIONS_H_

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/model/reflections/reflected_return.h"
#include "core/model/scan/range_surface.h"
#include "core/model/scan/scan_planes.h"

namespace vantage::model {

// True when there are any, judged by every `stride`-th column and row alone.
bool HasReflections(const RangeSurface& surface, const ReflectingPlane& plane, int stride);

// The cells of the whole image that are reflections, judged likewise.
std::vector<ScanCell> FindReflections(const RangeSurface& surface, const ReflectingPlane& plane,
                                      int stride);

struct SuspectedRegion {
  std::vector<ScanCell> cells;          // of every `stride`-th column and row
  std::optional<Eigen::Vector3d> wall;  // a point of the wall around it, m, scanner's frame
};
// What a mirror hangs on. Beside a door of a wardrobe, which stands out from its wall, a side wall
// that goes on in what the door shows says nothing; beside an opening in a wall it says that rooms
// are real.
enum class Hangs { kOnWall, kOnFurniture };
// Of an upright plane that does not reflect by what the scan alone tells: the regions that end like
// reflections in it; and, judged more roughly, whether there may be any.
std::vector<SuspectedRegion> FindSuspectedReflections(const RangeSurface& surface,
                                                      const ReflectingPlane& plane, int stride,
                                                      Hangs hangs);
bool MayHaveReflections(const RangeSurface& surface, const ReflectingPlane& plane, int stride);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTION_REGIONS_H_
