// From an overlap's geometry to a verdict in words: what a prediction and a real registration have
// in common (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_JUDGE_H_
#define VANTAGE_CORE_REGISTRATION_JUDGE_H_

#include <string>

#include "core/registration/error_bound.h"
#include "core/registration/verdict.h"

namespace vantage {

// What is known of the pose besides the overlap, as information about the overlap's centroid.
struct PoseKnowledge {
  Matrix6d guaranteed = Matrix6d::Zero();  // by instruments: counts in the verdict
  std::string guarantee;                   // 'levelling', 'trusted pose'; empty when there is none
  Matrix6d guessed = Matrix6d::Zero();     // counts in the millimetres only
};

// Overlap and error bound against what is required. Outcome, bounds, weakest direction, what
// decided, reason and remedy are filled in.
RegistrationVerdict Judge(const OverlapGeometry& geometry, double overlap_share,
                          const PoseKnowledge& known, const RegistrationConfig& config);

// The verdict of a scan that shares (almost) nothing with the model.
RegistrationVerdict NoOverlap(double overlap_share, const RegistrationConfig& config);

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_JUDGE_H_
