// The verdict whether a scan can be joined to the model, for a scan that was made and for one that
// is only planned (algorithm.md section 9, 'The verdict').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_VERDICT_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_VERDICT_H_

#include <optional>
#include <string>
#include <vector>

#include "core/registration/bound/basis.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

enum class RegistrationOutcome {
  kRegistered,  // merges by itself; for a planned view: will register
  kDoubtful,    // kept, a person decides
  kFailed,
};

struct RegistrationVerdict {
  RegistrationOutcome outcome = RegistrationOutcome::kFailed;
  double overlap_share = 0;   // of the new scan's samples, [0, 1]
  double error_bound = 0;     // E: m, 95 % quantile of the largest corner displacement, from
                              // all that is known, the guess of a pose included
  double judged_bound = 0;    // m, the same without the guess of a pose: decides the verdict
  double rigorous_bound = 0;  // sqrt(chi2_6 lambda_max), m, never below error_bound's truth
  double strength = 0;        // weakest over strongest direction, [0, 1]
  sensor::Vector6d weakest =
      sensor::Vector6d::Zero();  // pose change [rad; m], about the overlap's centroid
  std::string weakest_words;     // 'sliding along x'
  // What decided: one basis, or the guarantees that suffice together. Empty before it was judged.
  std::vector<RegistrationBasis> bases;
  // Where the required accuracy cannot be met with the instrument, however much overlaps: the bound
  // that can, m.
  std::optional<double> attainable_accuracy;
  std::string reason;  // why not registered; empty when it is
  std::string remedy;  // what to do about it; empty when registered

  bool registered() const { return outcome == RegistrationOutcome::kRegistered; }
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_VERDICT_H_
