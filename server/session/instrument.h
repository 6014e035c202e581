// What the scans of a session have shown of the instrument that made them.
#ifndef VANTAGE_SERVER_SESSION_INSTRUMENT_H_
#define VANTAGE_SERVER_SESSION_INSTRUMENT_H_

#include <string>

#include "core/registration/align/instrument_residuals.h"
#include "server/session/session_state.h"
#include "vantage/v1/scanner_model.pb.h"

namespace vantage::session {

// Of all scans by the same scanner (id and noise) that were not withdrawn, except `but`: a function
// of the set of these scans.
registration::InstrumentResiduals InstrumentShown(const SessionState& state,
                                                  const v1::ScannerModel& scanner,
                                                  const std::string& but = "");

// Different for any two that differ.
std::string Told(const registration::InstrumentResiduals& residuals);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_INSTRUMENT_H_
