// How few stations can be enough, by duality.
#ifndef VANTAGE_CORE_COVER_LOWER_BOUND_H_
#define VANTAGE_CORE_COVER_LOWER_BOUND_H_

#include <cstddef>
#include <cstdint>

#include "core/cover/instance.h"
#include "core/cover/meter.h"

namespace vantage::cover {

// No choice that covers `goal` (quanta) has fewer stations, whether they hang together or not.
// Rounded up: the linear relaxation's value is approached from below (Lagrangian relaxation of
// 'an element counts where a chosen candidate covers it', by subgradients), and every multiplier
// gives a bound. Ends when the meter is over, the bound is `enough`, or it no longer rises.
size_t LeastStations(const Instance& instance, int64_t goal, size_t enough, Meter& meter);

}  // namespace vantage::cover

#endif  // VANTAGE_CORE_COVER_LOWER_BOUND_H_
