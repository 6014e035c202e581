// Whether two range images, each in its scanner's own frame, show the same.
#ifndef VANTAGE_CORE_SENSOR_LIKENESS_H_
#define VANTAGE_CORE_SENSOR_LIKENESS_H_

#include "core/sensor/range_image.h"

namespace vantage::sensor {

// Of the returns of `preview` but for those that its row has in common (floor, ceiling), a sample
// of some thousands, or of all where those are few, the share at which `whole` has about the same
// range in the nearest direction: near 1 for a preview of the same scan, also one that the
// instrument made itself on a grid of its own; small for any other place. 0 where no direction is
// shared.
double ShareThatAgrees(const RangeImage& whole, const RangeImage& preview);

// True when both hold samples of one measurement: where directions are shared, ranges are equal to
// the last digit that is sent (0.1 mm). So are copies of a scan, and what is left of it when it is
// thinned or cropped; a second scan from the same place differs by its noise.
bool SameSamples(const RangeImage& a, const RangeImage& b);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_LIKENESS_H_
