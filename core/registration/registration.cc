#include "core/registration/registration.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/align.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/align/prior_search.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/align/targets.h"
#include "core/registration/align/voxel_search.h"
#include "core/registration/bound/instrument_limit.h"
#include "core/registration/bound/qualify.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/bound/rivals.h"
#include "core/registration/mirrors_told.h"
#include "core/registration/registration_input.h"

namespace vantage::registration {
namespace {

// The change from the trusted to the aligned pose, against what both leave open: chi-square of six
// degrees of freedom.
double Disagreement(const sensor::PosePrior& trusted, const RegistrationResult& aligned) {
  const Eigen::Isometry3d& from = trusted.T_world_scan;
  const Eigen::Matrix3d turn = aligned.T_world_scan.linear() * from.linear().transpose();
  const Eigen::AngleAxisd rotation(turn);
  sensor::Vector6d change;
  change << rotation.angle() * rotation.axis(),
      aligned.T_world_scan.translation() - from.translation();
  // The alignment's covariance is about the overlap's centroid: move it to the scanner.
  const sensor::Matrix6d move = AboutOther(from.translation() - aligned.centroid);
  const sensor::Matrix6d covariance =
      move * aligned.covariance * move.transpose() + *trusted.covariance;
  return change.dot(covariance.ldlt().solve(change));
}

// Samples that face along a change of the pose and lie on true surface at `pose`. Noise never turns
// a normal so far: a few dozen sides of pilasters tell where along a corridor a scan belongs,
// though they are too few to say how well.
struct Support {
  size_t samples = 0;
  double share = 0;  // of the change, that would bring them onto the surface
};
Support SupportAlong(const sensor::Vector6d& change, const Eigen::Vector3d& about,
                     const VoxelSearch& search, std::span<const SurfaceSample> samples,
                     const Eigen::Isometry3d& pose, double near) {
  constexpr double kFaces =
      0.5;  // cosine, 60 degrees: noise of normals of 0.1 rad is a tenth of it
  Support support;
  double along = 0;
  double squared = 0;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d point = pose * s.point.cast<double>();
    const Eigen::Vector3d normal = pose.linear() * s.normal.cast<double>();
    const Eigen::Vector3d move = change.tail<3>() + change.head<3>().cross(point - about);
    const double least = kFaces * move.norm();
    if (std::abs(normal.dot(move)) < least) continue;
    const Match match = search.Find(point, normal);
    if (match.voxel == nullptr || std::abs(match.normal.dot(move)) < least) continue;
    const double residual = (point - match.voxel->centroid.cast<double>()).dot(match.normal);
    if (std::abs(residual) >= near) continue;
    ++support.samples;
    const double moves = match.normal.dot(move);
    along -= moves * residual;
    squared += moves * moves;
  }
  if (squared > 0) support.share = along / squared;
  return support;
}

// In directions that nothing constrains, noisy normals hold a scan wherever a start has left it.
// There the prior decides, unless the scan has surface that it would lose at the prior's place.
RegistrationResult QualifyNearPrior(const model::PlanningView& model, const sensor::Scan& scan,
                                    const ScanSurface& surface, Alignment alignment,
                                    const sensor::PosePrior& prior,
                                    const RegistrationConfig& config,
                                    std::span<const TargetTie> targets,
                                    parallel::Parallel& parallel) {
  constexpr int kRounds = 2;           // a large turn is not a straight line
  constexpr double kConverged = 1e-3;  // m and rad
  constexpr size_t kFewest = 20;       // samples that hold it where it is,
  constexpr size_t kTimes = 4;         // and so many times what holds it near the prior
  constexpr double kNear = 3;          // residuals
  constexpr int kSteps = 5;
  const auto qualify = [&](const Alignment& at) {
    return Qualify(model, surface, at, prior, config, parallel, targets, &scan);
  };
  Qualification qualified = qualify(alignment);
  for (int round = 0; round < kRounds; ++round) {
    if (qualified.to_prior.cwiseAbs().maxCoeff() < kConverged) break;
    const Eigen::Vector3d about = qualified.result.centroid;
    const sensor::Vector6d change = qualified.to_prior;
    Alignment free = alignment;
    alignment.T_world_scan = MovedPose(alignment.T_world_scan, qualified.to_prior, about);
    PriorTerm constrained(prior, targets);
    constrained.Constrain({alignment.T_world_scan, about, qualified.open});
    alignment = Refine(model, surface, std::move(alignment), constrained, config, parallel);
    const auto support_of = [&](const Alignment& at) {
      return SupportAlong(change, about, VoxelSearch(model, BoxOf(surface, at.T_world_scan)),
                          surface.samples, at.T_world_scan, kNear * qualified.result.rms_residual);
    };
    if (round == 0) {
      Support here = support_of(free);
      if (here.samples >= kFewest && here.samples >= kTimes * support_of(alignment).samples) {
        // Only these samples count, since the noise of all others would hold the scan, too.
        for (int step = 0; step < kSteps; ++step, here = support_of(free)) {
          free.T_world_scan = MovedPose(free.T_world_scan, here.share * change, about);
        }
        return qualify(free).result;
      }
    }
    qualified = qualify(alignment);
  }
  return qualified.result;
}

// Where a scan contradicts what is known around its prior, the prior may be worse than it says: the
// scan is sought three times as far. What fits there is in doubt, since the prior spoke against it;
// its bound, which knows the prior for what it is, holds. Nothing where nothing else fits.
std::optional<RegistrationResult> FoundFarther(const model::PlanningView& model,
                                               const sensor::Scan& scan, const ScanSurface& surface,
                                               const sensor::PosePrior& prior,
                                               const RegistrationResult& near,
                                               const RegistrationConfig& config,
                                               parallel::Parallel& parallel) {
  constexpr double kContradicts = 0.1;  // more than furniture that was moved makes
  constexpr double kTimes = 3;
  constexpr double kOnePlace = 0.2;  // m: minima lie within a centimetre, rooms farther apart
  if (near.verdict.registered() || near.contradiction_share <= kContradicts ||
      !prior.covariance.has_value()) {
    return std::nullopt;
  }
  sensor::PosePrior wide = prior;
  *wide.covariance *= kTimes * kTimes;
  RegistrationResult found =
      QualifyNearPrior(model, scan, surface, Align(model, surface, wide, config, parallel), wide,
                       config, {}, parallel);
  RegistrationVerdict& verdict = found.verdict;
  const bool rivals =
      verdict.bases == std::vector<RegistrationBasis>{RegistrationBasis::kRivalPose};
  const auto place = [](const RegistrationResult& of) { return of.T_world_scan.translation(); };
  if ((!verdict.registered() && !rivals) || found.moved_area.has_value() ||
      found.contradiction_share > kContradictionDoubtful ||
      (place(found) - place(near)).norm() < kOnePlace) {
    return std::nullopt;
  }
  if (verdict.registered()) verdict.bases = {RegistrationBasis::kNoPosePrior};
  verdict.outcome = RegistrationOutcome::kDoubtful;
  const std::string rest = rivals ? absl::StrCat("; ", verdict.reason) : "";
  verdict.reason = absl::StrFormat(
      "its prior is %.2f m off what the surfaces say, and states a sigma of %.2f m (where it puts "
      "the scan, %.0f %% of it contradict what is known)%s",
      (place(found) - prior.T_world_scan.translation()).norm(),
      ReachOf(prior).shift / kSigmasOfPrior, 100 * near.contradiction_share, rest);
  verdict.remedy = "accept the pose if it is right, and say how good priors are";
  found.residuals.reset();
  return found;
}

RegistrationResult RegisterReturns(const model::PlanningView& model, const sensor::Scan& scan,
                                   const sensor::PosePrior& prior,
                                   std::span<const TargetTie> targets,
                                   const RegistrationConfig& config, parallel::Parallel& parallel) {
  const ScanSurface surface = SampleSurface(scan, config.sample_spacing, parallel);
  // A trusted pose is kept, and compared with where the scan's own evidence puts it: so it must not
  // hold the alignment.
  sensor::PosePrior guess = prior;
  if (prior.trusted) {
    guess.trusted = false;
    guess.covariance.reset();
  }
  Alignment alignment = Align(model, surface, guess, config, parallel, targets);
  LeaveOutWhatEndsAtTheBest(model, surface, config, parallel, alignment);
  RegistrationResult result;
  if (prior.trusted) {
    const RegistrationResult aligned =
        Qualify(model, surface, alignment, guess, config, parallel, targets).result;
    const bool checkable = aligned.correspondences > 0 && aligned.converged;
    Alignment kept = alignment;
    kept.T_world_scan = prior.T_world_scan;
    kept.converged = true;
    kept.displaced.reset();
    kept.rivals.clear();  // the pose was not chosen among minima
    kept.not_compared.clear();
    kept.open_within = kept.open_turn = 0;
    kept.left_out.clear();
    result = Qualify(model, surface, kept, prior, config, parallel, targets, &scan).result;
    // At a pose that was given, residuals hold its error, too.
    if (result.residuals.has_value()) result.residuals = aligned.residuals;
    constexpr double kChiSquare6At999 = 22.46;  // quantile of six degrees of freedom, 99.9 %
    if (checkable && Disagreement(prior, aligned) > kChiSquare6At999 &&
        aligned.verdict.overlap_share >= config.minimum_overlap) {
      const double shift =
          (aligned.T_world_scan.translation() - prior.T_world_scan.translation()).norm();
      result.verdict.outcome = RegistrationOutcome::kDoubtful;
      result.verdict.bases = {RegistrationBasis::kTrustedPose};
      result.residuals.reset();
      result.verdict.reason = absl::StrFormat(
          "the surfaces fit %.3f m away from the trusted pose, more than its covariance allows",
          shift);
      result.verdict.remedy = "check the control registration, or give its covariance as it is";
    }
  } else {
    result = QualifyNearPrior(model, scan, surface, alignment, prior, config, targets, parallel);
    if (targets.empty()) {
      auto farther = FoundFarther(model, scan, surface, prior, result, config, parallel);
      if (farther.has_value()) result = *std::move(farther);
    }
  }
  SayInstrumentLimit(surface, config, result);
  // A person may take one of them: it is to be as good as the aligned one.
  for (RivalPose& rival : result.rival_poses) {
    Alignment there;
    there.T_world_scan = rival.T_world_scan;
    rival.T_world_scan =
        Refine(model, surface, std::move(there), PriorTerm(guess, targets), config, parallel)
            .T_world_scan;
  }
  return result;
}

}  // namespace

absl::StatusOr<RegistrationResult> Register(const model::PlanningView& model,
                                            const sensor::Scan& scan,
                                            const sensor::PosePrior& prior,
                                            const RegistrationConfig& config,
                                            parallel::Parallel& parallel) {
  return RegisterWithTargets(model, scan, prior, {}, config, parallel);
}

absl::StatusOr<RegistrationResult> RegisterWithTargets(const model::PlanningView& model,
                                                       const sensor::Scan& scan,
                                                       const sensor::PosePrior& prior,
                                                       std::span<const TargetTie> targets,
                                                       const RegistrationConfig& config,
                                                       parallel::Parallel& parallel) {
  const auto started = std::chrono::steady_clock::now();
  const absl::Status valid = ValidateRegistration(model, scan, prior, config);
  if (!valid.ok()) return valid;
  if (absl::Status status = ValidateTargets(targets); !status.ok()) return status;
  RegistrationResult result = WithMirrorsTold(scan, parallel, [&](const sensor::Scan& returns) {
    return RegisterReturns(model, returns, prior, targets, config, parallel);
  });
  result.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace vantage::registration
