// Finds the connected returns from behind a plane that are reflections in it (algorithm.md section
// 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTION_REGIONS_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTION_REGIONS_H_

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

// Of an upright plane that does not reflect by what the scan alone tells: the regions, by cells of
// every `stride`-th column and row, that end like reflections in it; and, judged more roughly,
// whether there may be any.
std::vector<std::vector<ScanCell>> FindSuspectedReflections(const RangeSurface& surface,
                                                            const ReflectingPlane& plane,
                                                            int stride);
bool MayHaveReflections(const RangeSurface& surface, const ReflectingPlane& plane, int stride);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTION_REGIONS_H_
