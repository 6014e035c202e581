// A registration that a mirror misled, once more without what the mirror shows.
#ifndef VANTAGE_CORE_REGISTRATION_MIRRORS_TOLD_H_
#define VANTAGE_CORE_REGISTRATION_MIRRORS_TOLD_H_

#include <optional>

#include "core/parallel/parallel.h"
#include "core/registration/align/without_reflections.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// Share of a scan, that anything moved explains, for any scanner. A mirror of a square metre fills
// more of a panoramic scan from nearer than a metre and a half.
inline constexpr double kLittleContradiction = 0.03;

// What a mirror shows lies behind its wall, in space that other scans know: it contradicts like a
// wrong pose does. To tell it takes half as long as to align, so only a scan in doubt is asked.
template <typename RegisterScan>
RegistrationResult WithMirrorsTold(const sensor::Scan& scan, parallel::Parallel& parallel,
                                   const RegisterScan& register_scan) {
  RegistrationResult result = register_scan(scan);
  if (result.verdict.registered() || result.contradiction_share <= kLittleContradiction) {
    return result;
  }
  const std::optional<sensor::Scan> direct = WithoutReflections(scan, parallel);
  return direct ? register_scan(*direct) : result;
}

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_MIRRORS_TOLD_H_
