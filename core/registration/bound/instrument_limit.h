// When an instrument cannot meet what is required of registrations, wherever it stands, and what it
// can (algorithm.md section 9, 'What the instrument shows').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_INSTRUMENT_LIMIT_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_INSTRUMENT_LIMIT_H_

#include <optional>
#include <string>

#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/bound/prediction.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// `full`: of a scan that overlaps by all that it sees. Where that does not meet the required
// accuracy, and not the shape of the surroundings is why (by its data sheet the instrument would
// meet it there, or would not even in a closed room): the bound that it has, m. Else nothing.
std::optional<double> AttainableInstead(const ExpectedBounds& full,
                                        const sensor::ScannerModel& scanner,
                                        const RegistrationConfig& config);

// The bound, by the data sheet, of a scan in the middle of a closed room of 5 x 4 x 2.5 m that was
// scanned from there before, m: near surface in all directions, and nothing beside it.
double ClosedRoomBound(const sensor::ScannerModel& scanner, const RegistrationConfig& config);

// 'the required accuracy of 10 mm cannot be met with this instrument: about 26 mm can', and what to
// set it to, so that predictions meet it, too.
std::string InstrumentLimitReason(double attainable, const RegistrationConfig& config);
std::string InstrumentLimitRemedy(double attainable);

// Adds to a verdict that rests on the residuals of a scan (RegistrationBasis::kResiduals) that the
// required accuracy cannot be met, where this scan and those before show it.
void SayInstrumentLimit(const ScanSurface& surface, const RegistrationConfig& config,
                        RegistrationResult& result);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_INSTRUMENT_LIMIT_H_
