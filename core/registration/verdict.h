// Can a scan be joined to the model? The same words for a scan that was made and for one that is
// only planned (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_VERDICT_H_
#define VANTAGE_CORE_REGISTRATION_VERDICT_H_

#include <string>

#include "absl/status/status.h"

#include "core/sensor/scan.h"

namespace vantage {

enum class RegistrationOutcome {
  kRegistered,  // merges by itself; for a planned view: will register
  kDoubtful,    // kept, a person decides
  kFailed,
};

struct RegistrationConfig {
  double required_accuracy = 0.010;  // m at 95 %, > 0
  double minimum_overlap = 0.10;     // share of the new scan's samples, (0, 1)
  double correlation_length = 0.5;   // m, of residuals
  double correlated_sigma = 0.002;   // m, sigma_c, the part that averaging does not remove
  double normal_sigma = 0.035;       // rad, noise of estimated normals
  double sample_spacing = 0.05;      // m, the scan is thinned to this before aligning
  double max_correspondence = 0.5;   // m, at the start of the alignment; shrinks
  // rad, the inclinometer that planned scans will have, one sigma; 0: none. Of a scan that was
  // made, its prior says it.
  double levelled_sigma = 0;
  int draws = 256;    // of the error bound's Monte Carlo
  unsigned seed = 1;  // of those draws, and printed with them

  absl::Status Validate() const;
};

struct RegistrationVerdict {
  RegistrationOutcome outcome = RegistrationOutcome::kFailed;
  double overlap_share = 0;   // of the new scan's samples, [0, 1]
  double error_bound = 0;     // E: m, 95 % quantile of the largest corner displacement, from
                              // all that is known, the guess of a pose included
  double judged_bound = 0;    // m, the same without the guess of a pose: decides the verdict
  double rigorous_bound = 0;  // sqrt(chi2_6 lambda_max), m, never below error_bound's truth
  double strength = 0;        // weakest over strongest direction, [0, 1]
  Vector6d weakest = Vector6d::Zero();  // pose change [rad; m], about the overlap's centroid
  std::string weakest_words;            // 'sliding along x (east-west)'
  std::string decided_by;               // 'scan geometry', 'levelling', 'targets', ...
  std::string reason;                   // why not registered; empty when it is
  std::string remedy;                   // what to do about it; empty when registered

  bool registered() const { return outcome == RegistrationOutcome::kRegistered; }
};

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_VERDICT_H_
