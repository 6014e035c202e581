// The floor that a scan shows.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_FLOOR_PLANE_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_FLOOR_PLANE_H_

#include <Eigen/Core>
#include <span>

#include "core/registration/align/scan_surface.h"

namespace vantage::registration {

// A plane that scanned surface lies in.
struct FloorPlane {
  Eigen::Vector3d normal;  // unit, scanner frame, upwards
  double height = 0;       // m, of the plane over the scanner's origin, < 0: normal . x = height
  double area = 0;         // m^2, roughly, of the samples in it
};
// The largest upward-facing plane below the scanner within `max_tilt` rad of level; where others of
// another slope are at least a tenth as large, such as the floor beside a ramp, the one to which
// the walls are vertical, if they tell. False when there is none of at least half a square metre.
bool FindFloorPlane(std::span<const SurfaceSample> samples, double spacing, double max_tilt,
                    FloorPlane& floor);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_FLOOR_PLANE_H_
