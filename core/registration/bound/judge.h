// From an overlap's geometry to a verdict in words: what a prediction and a real registration have
// in common (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_JUDGE_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_JUDGE_H_

#include <string>
#include <vector>

#include "core/registration/align/registration_config.h"
#include "core/registration/bound/error_bound.h"
#include "core/registration/bound/verdict.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// What an instrument guarantees of the pose, as information about the overlap's centroid.
struct PoseEvidence {
  RegistrationBasis basis;  // kLevelling, kTargets or kTrustedPose
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
};

// What is known of the pose besides the overlap.
struct PoseKnowledge {
  std::vector<PoseEvidence> evidence;                   // count in the verdict
  sensor::Matrix6d guessed = sensor::Matrix6d::Zero();  // counts in the millimetres only

  sensor::Matrix6d EvidenceInformation() const;
};

// What is asked of figures besides the requirements, else there is a doubt: nothing of those that
// were measured, more of those that are predicted.
struct Margins {
  double bound = 1;    // factor >= 1 by which the bound has to be within the required accuracy
  double overlap = 0;  // share, (0, 1], instead of minimum_overlap where that is less
};

// Compares overlap and error bound with what is required. Fills in outcome, bounds, weakest
// direction, basis (the scan's geometry, or the evidence that suffices), reason and remedy.
RegistrationVerdict JudgeRegistration(const OverlapGeometry& geometry, double overlap_share,
                                      const PoseKnowledge& known, const RegistrationConfig& config,
                                      const Margins& margins = {});

// Why a bound is beyond what is required that would be within it by the instrument's data sheet,
// and what to do about it.
std::string ResidualsReason(double bound, const RegistrationConfig& config);
inline constexpr const char* kLessIsAsked =
    "stand nearer to what is scanned already, with more of it in view, or require less: set "
    "required_accuracy";

// The verdict of a scan that shares (almost) nothing with the model.
RegistrationVerdict NoOverlap(double overlap_share, const RegistrationConfig& config);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_JUDGE_H_
