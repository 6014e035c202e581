// Whether a scan may have been made by a scanner on its side: whether a plane at right angles to
// what was taken for its floor would make the better one.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_SIDEWAYS_FLOOR_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_SIDEWAYS_FLOOR_H_

#include <optional>
#include <span>

#include "core/registration/align/floor_plane.h"
#include "core/registration/align/scan_surface.h"
#include "core/sensor/range_image.h"

namespace vantage::registration {

struct SidewaysFloor {
  double distance = 0;  // m, from the scanner
  // m^2, of it and of what lies opposite, and of all that is level if the scanner stood upright.
  double area = 0;
  double level_area = 0;
};
// `samples` and `floor` in the scanner's frame. A rival lies about as far from the scanner as
// floors do and next to nothing is behind it. Of the two the floor is the one that, with its
// ceiling, has more surface: rooms are wider than high. So a rival is named where it has clearly
// more, as in no upright scan of an ordinary room; nothing where there is none, or where the sky is
// above.
std::optional<SidewaysFloor> FindSidewaysFloor(std::span<const SurfaceSample> samples,
                                               const sensor::RangeImage& image, double spacing,
                                               const FloorPlane& floor);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_SIDEWAYS_FLOOR_H_
