// Finds the reflectors that a scan suspects and cannot tell by itself (algorithm.md section 4,
// 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_SUSPECTS_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_SUSPECTS_H_

#include <vector>

#include "core/model/reflections/reflected_return.h"
#include "core/model/reflections/suspected_reflector.h"
#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// `surface`: without the reflections that the scan told. `untold`: planes in which it told none.
// The largest suspects come first.
std::vector<SuspectedReflector> FindSuspects(const RangeSurface& surface,
                                             const std::vector<ReflectingPlane>& untold,
                                             parallel::Parallel& parallel);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_SUSPECTS_H_
