// A prior of a stranger, parsed in a process of its own (core/confinement).
#ifndef VANTAGE_CORE_SITE_PRIOR_CONFINED_PRIOR_H_
#define VANTAGE_CORE_SITE_PRIOR_CONFINED_PRIOR_H_

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/confinement/allowance.h"
#include "core/confinement/bulk.h"
#include "core/confinement/reader.h"
#include "core/site_prior/prior_file.h"
#include "core/site_prior/prior_mesh.h"

namespace vantage::site_prior {

// The reader, for main() to hand to confinement::RunIfReader().
confinement::Reader SitePriorReader();

// As ParsePrior(), of an open file of `size` bytes, which the caller keeps. Of what goes wrong with
// the reader itself the errors are those of confinement::Child.
absl::StatusOr<PriorMesh> ReadPriorConfined(int file, uint64_t size, const PriorReading& reading,
                                            const confinement::AllowanceSettings& settings);

// What the reader answers, as it is heard: of a stranger, so that it is checked (CheckPrior()).
absl::StatusOr<PriorMesh> HearPrior(confinement::HearBytes hear);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_CONFINED_PRIOR_H_
