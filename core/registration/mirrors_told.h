// Repeats a registration that a mirror misled, without what the mirror shows (algorithm.md section
// 9, 'Alignment').
#ifndef VANTAGE_CORE_REGISTRATION_MIRRORS_TOLD_H_
#define VANTAGE_CORE_REGISTRATION_MIRRORS_TOLD_H_

#include <optional>

#include "core/parallel/parallel.h"
#include "core/registration/align/without_reflections.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// The share of a scan that may contradict the model because things were moved, for any scanner. A
// mirror of a square metre fills more of a panoramic scan within a metre and a half.
inline constexpr double kLittleContradiction = 0.03;

// Registers a scan and, where it is in doubt and contradicts the model, or contradicts it by what
// is taken for things that were moved, once more without its reflections. Finding reflections takes
// half as long as aligning, so it is done only in doubt.
template <typename RegisterScan>
RegistrationResult WithMirrorsTold(const sensor::Scan& scan, parallel::Parallel& parallel,
                                   const RegisterScan& register_scan) {
  RegistrationResult result = register_scan(scan);
  const bool in_doubt = !result.verdict.registered() || result.moved_area.has_value();
  if (!in_doubt || result.contradiction_share <= kLittleContradiction) return result;
  const std::optional<sensor::Scan> direct = WithoutReflections(scan, parallel);
  return direct ? register_scan(*direct) : result;
}

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_MIRRORS_TOLD_H_
