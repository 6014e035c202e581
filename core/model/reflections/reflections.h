// Reflections: returns that came by way of a mirror or a polished floor and seem to lie behind
// it (algorithm.md section 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTIONS_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTIONS_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/model/reflections/aperture.h"
#include "core/model/reflections/suspected_reflector.h"
#include "core/model/scan/range_surface.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// A plane that reflected: normal . x = -distance, scanner's frame.
struct Reflector {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, towards the scanner
  double distance = 0;                                // m, > 0
  size_t cells = 0;                                   // whose returns came by way of it
  Aperture aperture;                                  // scanner's frame
};

// Finds the returns that a scan by itself shows to be reflections, by the rule of algorithm.md
// section 4, 'Reflections', and ends their rays at the reflector (OpenRangeSurface::EndAt). The
// result is a function of the image alone. A part of a dense image is judged, so that the time
// hardly depends on its density.
std::vector<Reflector> EndReflections(OpenRangeSurface& surface, parallel::Parallel& parallel);

// The same, and the reflectors that the scan suspects besides, for other scans to tell.
struct Reflections {
  std::vector<Reflector> reflectors;
  std::vector<SuspectedReflector> suspects;
};
Reflections EndAndSuspectReflections(OpenRangeSurface& surface, parallel::Parallel& parallel);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTIONS_H_
