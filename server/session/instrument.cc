#include "server/session/instrument.h"

#include <utility>
#include <vector>

#include "absl/strings/str_format.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

bool SameInstrument(const v1::ScannerModel& a, const v1::ScannerModel& b) {
  return a.id() == b.id() && a.range_noise_m() == b.range_noise_m() &&
         a.range_noise_ppm() == b.range_noise_ppm();
}

}  // namespace

registration::InstrumentResiduals InstrumentShown(const SessionState& state,
                                                  const v1::ScannerModel& scanner,
                                                  const std::string& but) {
  std::vector<registration::PairResiduals> scans;
  for (const auto& [name, record] : state.scans) {
    const v1::Scan& scan = record.scan;
    if (name == but || scan.state() == v1::SCAN_STATE_WITHDRAWN ||
        scan.registration().class_residuals().empty() ||
        !SameInstrument(scan.scanner_model(), scanner)) {
      continue;
    }
    scans.push_back(conversion::ReadOwnResiduals(scan.registration()));
  }
  return registration::InstrumentResiduals::Of(std::move(scans));
}

std::string Told(const registration::InstrumentResiduals& residuals) {
  std::string told;
  if (residuals.empty()) return told;
  for (const registration::ClassResiduals& of : residuals.sums()) {
    absl::StrAppendFormat(&told, "%a %a %a %a %a ", of.blocks, of.shared, of.freedom, of.scatter,
                          of.expected);
  }
  told += "\n";
  return told;
}

}  // namespace vantage::session
