// Previews: scans of which only some rays are sent at first, since the rest takes hours to arrive.
#ifndef VANTAGE_CORE_SENSOR_THINNING_H_
#define VANTAGE_CORE_SENSOR_THINNING_H_

#include "core/sensor/range_image.h"

namespace vantage::sensor {

// Columns and rows at least `step` (rad, > 0) apart, as they were measured, never averaged: a mean
// of two surfaces lies on neither. Each ray stands for those around it that are left out, so the
// native steps stay the instrument's. Equal to `image` where that is as coarse already.
RangeImage Thinned(const RangeImage& image, double step);

// Of the returns of `preview` but for those that its row has in common (floor, ceiling), a sample
// of some thousands, the share at which `whole` has about the same range in the nearest direction:
// near 1 for a preview of the same scan, also one that the instrument made itself on a grid of its
// own; small for any other place. 0 where no direction is shared.
double ShareThatAgrees(const RangeImage& whole, const RangeImage& preview);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_THINNING_H_
