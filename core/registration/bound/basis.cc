#include "core/registration/bound/basis.h"

#include "absl/strings/str_cat.h"

namespace vantage::registration {

const char* BasisName(RegistrationBasis basis) {
  switch (basis) {
    case RegistrationBasis::kScanGeometry:
      return "scan geometry";
    case RegistrationBasis::kLevelling:
      return "levelling";
    case RegistrationBasis::kTargets:
      return "targets";
    case RegistrationBasis::kTrustedPose:
      return "trusted pose";
    case RegistrationBasis::kOverlap:
      return "overlap";
    case RegistrationBasis::kNoPosePrior:
      return "no pose prior";
    case RegistrationBasis::kResiduals:
      return "residuals";
    case RegistrationBasis::kContradiction:
      return "contradiction";
    case RegistrationBasis::kRivalPose:
      return "rival pose";
    case RegistrationBasis::kNotConverged:
      return "convergence";
  }
  return "";
}

std::string BasesText(std::span<const RegistrationBasis> bases) {
  std::string text;
  for (const RegistrationBasis basis : bases) {
    absl::StrAppend(&text, text.empty() ? "" : " and ", BasisName(basis));
  }
  return text;
}

}  // namespace vantage::registration
