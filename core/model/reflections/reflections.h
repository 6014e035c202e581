// Reflections: returns that came by way of a mirror or a polished floor and seem to lie behind
// it (algorithm.md section 4, 'What never comes').
#ifndef VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTIONS_H_
#define VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTIONS_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/model/reflections/aperture.h"
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

// Finds what a scan by itself shows to be reflections, and ends those rays at the reflector
// (RangeSurface::EndAt).
//
// A plane comes into question when it reflects one measured plane into another behind it, or when
// it is measured itself and has returns from behind it scattered among its own (a polished floor).
// The cells with returns from behind it fall into connected regions. One is a reflection when
//  - most of it lies more than 15 cm behind the plane (the relief of a wall fits anything);
//  - most of the surface in it lies, reflected back, on surface that the scan measured: surface
//    that reflecting displaces, since floors and side walls of a real room behind a doorway would
//    fit their own reflection too;
//  - hardly anything lies, reflected back, where the scan saw empty space (the jambs and the
//    furniture of a real room would);
//  - at most of its border the surface breaks off against the plane itself: the wall around a
//    mirror (a symmetric room goes on through its middle, a doorway has its depth); or its returns
//    lie scattered among the plane's own.
//
// Judged on a part of a dense image, so that it costs much the same for any density; a function of
// the image alone.
std::vector<Reflector> EndReflections(RangeSurface& surface, parallel::Parallel& parallel);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_REFLECTIONS_REFLECTIONS_H_
