// Previews: scans of which only some rays are sent at first, since the rest takes hours to arrive.
#ifndef VANTAGE_CORE_SENSOR_THINNING_H_
#define VANTAGE_CORE_SENSOR_THINNING_H_

#include "core/sensor/range_image.h"

namespace vantage::sensor {

// Columns and rows at least `step` (rad, > 0) apart, as they were measured, never averaged: a mean
// of two surfaces lies on neither. Each ray stands for those around it that are left out, so the
// native steps stay the instrument's. Equal to `image` where that is as coarse already.
RangeImage Thinned(const RangeImage& image, double step);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_THINNING_H_
