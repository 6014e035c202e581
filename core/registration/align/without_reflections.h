// A scan without what came by way of mirrors (algorithm.md section 4, 'What never comes').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_WITHOUT_REFLECTIONS_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_WITHOUT_REFLECTIONS_H_

#include <optional>

#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// The scan without the returns that it shows by itself to be reflections
// (core/model/reflections/reflections.h): those cells hold no information. Nothing where it shows
// none. Does not depend on a pose.
std::optional<sensor::Scan> WithoutReflections(const sensor::Scan& scan,
                                               parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_WITHOUT_REFLECTIONS_H_
