// From an overlap's geometry to a verdict in words: what a prediction and a real registration have
// in common (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_JUDGE_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_JUDGE_H_

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

// Compares overlap and error bound with what is required. Fills in outcome, bounds, weakest
// direction, basis (the scan's geometry, or the evidence that suffices), reason and remedy.
// `margin` >= 1: a bound that is not within the requirement by this factor makes a doubt.
RegistrationVerdict JudgeRegistration(const OverlapGeometry& geometry, double overlap_share,
                                      const PoseKnowledge& known, const RegistrationConfig& config,
                                      double margin = 1);

// The verdict of a scan that shares (almost) nothing with the model.
RegistrationVerdict NoOverlap(double overlap_share, const RegistrationConfig& config);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_JUDGE_H_
