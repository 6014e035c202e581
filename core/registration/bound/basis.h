// What a verdict on a registration rests on.
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_BASIS_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_BASIS_H_

#include <span>
#include <string>

namespace vantage::registration {

// Whatever knows the pose best, or what speaks against it.
enum class RegistrationBasis {
  kScanGeometry,   // the surfaces that the scan has in common with the model
  kLevelling,      // those, with an inclinometer
  kTargets,        // targets: they fix the pose, or one of them contradicts it
  kTrustedPose,    // the pose as given, which its caller trusts, or which the surfaces contradict
  kOverlap,        // too little overlap with the model
  kNoPosePrior,    // no prior, and the shape alone does not tell the place surely
  kResiduals,      // surfaces that lie farther apart than noise explains
  kContradiction,  // samples in space known to be empty, or behind walls
  kRivalPose,      // another pose that fits almost as well
  kNotConverged,   // an alignment that did not converge
};

// 'scan geometry', 'levelling', ...
const char* BasisName(RegistrationBasis basis);

// The names, joined by 'and'; empty for none.
std::string BasesText(std::span<const RegistrationBasis> bases);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_BASIS_H_
