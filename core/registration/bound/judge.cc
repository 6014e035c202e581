#include "core/registration/bound/judge.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/bound/direction_words.h"

namespace vantage::registration {
namespace {

// Up to this many times the required accuracy a person may still decide; beyond it the scan has
// failed. At three times, every second pose is still within the requirement along the weakest
// direction.
constexpr double kDoubtfulFactor = 3.0;
constexpr const char* kMoreOverlap =
    "stand nearer to what is scanned already, with more of it in view";

std::string Millimetres(double metres) {
  if (metres >= OverlapGeometry::kUnconstrained) return "unbounded";
  if (metres >= 0.1) return absl::StrFormat("%.2f m", metres);
  return absl::StrFormat("%.1f mm", metres * 1000);
}

std::string OverlapReason(double share, const RegistrationConfig& config, double asked = 0) {
  std::string reason = absl::StrFormat(
      "only %.1f %% of the scan overlaps what is scanned already, %.0f %% are "
      "required",
      100 * share, 100 * config.minimum_overlap);
  if (share >= config.minimum_overlap) {
    absl::StrAppendFormat(&reason, ", and %.0f %% of a prediction", 100 * asked);
  }
  return reason;
}

// The first evidence that meets the requirement by itself, or all of them.
std::vector<RegistrationBasis> WhatDecided(const OverlapGeometry& geometry,
                                           const PoseKnowledge& known, double required) {
  std::vector<RegistrationBasis> all;
  for (const PoseEvidence& e : known.evidence) {
    if (known.evidence.size() == 1 || geometry.Bound(e.information).bound <= required) {
      return {e.basis};
    }
    all.push_back(e.basis);
  }
  return all;
}

}  // namespace

sensor::Matrix6d PoseKnowledge::EvidenceInformation() const {
  sensor::Matrix6d sum = sensor::Matrix6d::Zero();
  for (const PoseEvidence& e : evidence) sum += e.information;
  return sum;
}

RegistrationVerdict JudgeRegistration(const OverlapGeometry& geometry, double overlap_share,
                                      const PoseKnowledge& known, const RegistrationConfig& config,
                                      const Margins& margins) {
  const ErrorBound alone = geometry.Bound(sensor::Matrix6d::Zero());
  const sensor::Matrix6d evidence = known.EvidenceInformation();
  const ErrorBound judged = known.evidence.empty() ? alone : geometry.Bound(evidence);
  const ErrorBound all =
      known.guessed.isZero(0) ? judged : geometry.Bound(evidence + known.guessed);
  RegistrationVerdict verdict;
  verdict.overlap_share = overlap_share;
  verdict.error_bound = all.bound;
  verdict.judged_bound = judged.bound;
  verdict.rigorous_bound = all.rigorous;
  verdict.strength = judged.strength;
  verdict.weakest = judged.weakest;
  const DirectionWords words =
      DescribeDirection(judged.weakest, 0.5 * geometry.box().diagonal().norm());
  verdict.weakest_words = words.direction;
  verdict.bases = {RegistrationBasis::kScanGeometry};

  if (!(margins.bound * judged.bound <= config.required_accuracy)) {
    verdict.outcome = judged.bound <= kDoubtfulFactor * config.required_accuracy
                          ? RegistrationOutcome::kDoubtful
                          : RegistrationOutcome::kFailed;
    verdict.reason = absl::StrCat("the overlap's shape leaves ", words.direction,
                                  " open: error bound ", Millimetres(judged.bound), ", ",
                                  Millimetres(config.required_accuracy), " required");
    if (judged.bound <= config.required_accuracy) {
      absl::StrAppendFormat(&verdict.reason, ", and a prediction may be off by a factor of %.1f",
                            margins.bound);
    }
    verdict.remedy = words.remedy;
  } else {
    verdict.outcome = RegistrationOutcome::kRegistered;
    if (margins.bound * alone.bound > config.required_accuracy) {
      verdict.bases = WhatDecided(geometry, known, config.required_accuracy / margins.bound);
    }
  }
  if (overlap_share < std::max(config.minimum_overlap, margins.overlap)) {
    if (verdict.registered()) {
      verdict.outcome = RegistrationOutcome::kDoubtful;
      verdict.bases = {RegistrationBasis::kOverlap};
      verdict.reason = OverlapReason(overlap_share, config, margins.overlap);
      verdict.remedy = kMoreOverlap;
    } else {
      verdict.reason = absl::StrCat(OverlapReason(overlap_share, config, margins.overlap), ", and ",
                                    verdict.reason);
    }
  }
  return verdict;
}

std::string ResidualsReason(double bound, const RegistrationConfig& config) {
  return absl::StrCat(
      "surfaces that this instrument measures lie farther apart than its data sheet "
      "explains: error bound ",
      Millimetres(bound), ", ", Millimetres(config.required_accuracy), " required");
}

RegistrationVerdict NoOverlap(double overlap_share, const RegistrationConfig& config) {
  RegistrationVerdict verdict;
  verdict.outcome = RegistrationOutcome::kFailed;
  verdict.overlap_share = overlap_share;
  verdict.error_bound = verdict.judged_bound = verdict.rigorous_bound =
      2 * OverlapGeometry::kUnconstrained;
  verdict.weakest_words = "every direction";
  verdict.bases = {RegistrationBasis::kOverlap};
  verdict.reason = OverlapReason(overlap_share, config);
  verdict.remedy = kMoreOverlap;
  return verdict;
}

}  // namespace vantage::registration
