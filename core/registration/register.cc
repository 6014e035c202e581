#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/align.h"
#include "core/registration/anywhere.h"
#include "core/registration/correspondence_field.h"
#include "core/registration/place_search.h"
#include "core/registration/pose_step.h"
#include "core/registration/qualify.h"
#include "core/registration/registration.h"
#include "core/registration/scan_surface.h"
#include "core/registration/targets.h"
#include "core/registration/without_reflections.h"

namespace vantage {
namespace {

constexpr double kLittleContradiction = 0.03;  // share of a scan, that anything moved explains

absl::Status ValidatePrior(const PosePrior& prior) {
  const Eigen::Isometry3d& pose = prior.T_world_scan;
  if (!pose.matrix().allFinite()) {
    return absl::InvalidArgumentError("pose prior: rotation and translation must be finite");
  }
  const Eigen::Matrix3d rotation = pose.linear();
  if (!(rotation * rotation.transpose()).isIdentity(1e-6) || rotation.determinant() < 0) {
    return absl::InvalidArgumentError(
        "pose prior: not a rigid transform; give a unit quaternion (w, x, y, z)");
  }
  if (prior.covariance.has_value()) {
    const Matrix6d& c = *prior.covariance;
    if (!c.allFinite() || !c.isApprox(c.transpose(), 1e-9) ||
        Eigen::LLT<Matrix6d>(c).info() != Eigen::Success) {
      return absl::InvalidArgumentError(
          "pose prior: covariance must be finite, symmetric and positive definite");
    }
    constexpr double kLeastVariance = 1e-16;  // rad^2, m^2; nobody knows better
    if (!(c.diagonal().minCoeff() >= kLeastVariance)) {
      return absl::InvalidArgumentError(
          "pose prior: covariance needs variances of at least 1e-16 rad^2 and m^2");
    }
  }
  if (prior.levelled_sigma.has_value() &&
      !(*prior.levelled_sigma > 0 && *prior.levelled_sigma <= 0.2)) {
    return absl::InvalidArgumentError("pose prior: levelled_sigma must be in (0, 0.2] rad");
  }
  if (prior.trusted && !prior.covariance.has_value()) {
    return absl::InvalidArgumentError("pose prior: a trusted pose needs a covariance");
  }
  return absl::OkStatus();
}

// The change from the trusted to the aligned pose, against what both leave open: chi-square of six
// degrees of freedom.
double Disagreement(const PosePrior& trusted, const RegistrationResult& aligned) {
  const Eigen::Isometry3d& from = trusted.T_world_scan;
  const Eigen::Matrix3d turn = aligned.T_world_scan.linear() * from.linear().transpose();
  const Eigen::AngleAxisd rotation(turn);
  Vector6d change;
  change << rotation.angle() * rotation.axis(),
      aligned.T_world_scan.translation() - from.translation();
  // The alignment's covariance is about the overlap's centroid: move it to the scanner.
  const Eigen::Vector3d arm = from.translation() - aligned.centroid;
  Matrix6d move = Matrix6d::Identity();
  move.bottomLeftCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  const Matrix6d covariance = move * aligned.covariance * move.transpose() + *trusted.covariance;
  return change.dot(covariance.ldlt().solve(change));
}

absl::Status Validate(const PlanningView& model, const Scan& scan, const PosePrior& prior,
                      const RegistrationConfig& config) {
  if (absl::Status status = config.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.scanner.Validate(); !status.ok()) return status;
  if (absl::Status status = scan.image.Validate(); !status.ok()) return status;
  if (absl::Status status = ValidatePrior(prior); !status.ok()) return status;
  for (const BrickAt& at : model.bricks()) {
    for (const VoxelState state : at.contents->state) {
      if (state == VoxelState::kTrueSurface) return absl::OkStatus();
    }
  }
  return absl::FailedPreconditionError(
      "the model has no true surface to align to; insert a first scan");
}

// Samples that face along a change of the pose and lie on true surface at `pose`. Noise never turns
// a normal so far: a few dozen sides of pilasters tell where along a corridor a scan belongs,
// though they are too few to say how well.
struct Hold {
  size_t samples = 0;
  double share = 0;  // of the change, that would bring them onto the surface
};
Hold HoldAgainst(const Vector6d& change, const Eigen::Vector3d& about, const VoxelSearch& search,
                 std::span<const SurfaceSample> samples, const Eigen::Isometry3d& pose,
                 double near) {
  constexpr double kFaces = 0.5;  // cosine
  Hold hold;
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
    ++hold.samples;
    const double moves = match.normal.dot(move);
    along -= moves * residual;
    squared += moves * moves;
  }
  if (squared > 0) hold.share = along / squared;
  return hold;
}

// Noisy normals hold a scan wherever a start has left it in directions that nothing constrains.
// What is known beforehand decides there, unless surface does that the prior's place would lose.
RegistrationResult QualifyNearPrior(const PlanningView& model, const ScanSurface& surface,
                                    Alignment alignment, const PosePrior& prior,
                                    const RegistrationConfig& config,
                                    std::span<const TargetTie> targets, Parallel& parallel) {
  constexpr int kRounds = 2;         // a large turn is not a straight line
  constexpr double kSettled = 1e-3;  // m and rad
  constexpr size_t kFewest = 20;     // samples that hold it where it is,
  constexpr size_t kTimes = 4;       // and so many times what holds it near the prior
  constexpr double kNear = 3;        // residuals
  constexpr int kSteps = 5;
  Qualification qualified = Qualify(model, surface, alignment, prior, config, parallel, targets);
  for (int round = 0; round < kRounds; ++round) {
    if (qualified.to_prior.cwiseAbs().maxCoeff() < kSettled) break;
    const Eigen::Vector3d about = qualified.result.centroid;
    const Vector6d change = qualified.to_prior;
    Alignment free = alignment;
    alignment.T_world_scan = Moved(alignment.T_world_scan, qualified.to_prior, about);
    PriorTerm held(prior, targets);
    held.Hold({alignment.T_world_scan, about, qualified.open});
    alignment = Refine(model, surface, std::move(alignment), held, config, parallel);
    const auto hold_of = [&](const Alignment& at) {
      return HoldAgainst(change, about, VoxelSearch(model, BoxOf(surface, at.T_world_scan)),
                         surface.samples, at.T_world_scan, kNear * qualified.result.rms_residual);
    };
    if (round == 0) {
      Hold here = hold_of(free);
      if (here.samples >= kFewest && here.samples >= kTimes * hold_of(alignment).samples) {
        // By those alone, since the noise of all others would hold it too.
        for (int step = 0; step < kSteps; ++step, here = hold_of(free)) {
          free.T_world_scan = Moved(free.T_world_scan, here.share * change, about);
        }
        return Qualify(model, surface, free, prior, config, parallel, targets).result;
      }
    }
    qualified = Qualify(model, surface, alignment, prior, config, parallel, targets);
  }
  return qualified.result;
}

double SecondsSince(std::chrono::steady_clock::time_point started) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
}

// Two rooms can look alike, and one of them need not have been scanned: without a prior, little
// overlap or much contradiction is not enough to merge.
void DoubtWhatShapeAloneFound(RegistrationResult& result) {
  constexpr double kLeastOverlap = 0.35;
  RegistrationVerdict& verdict = result.verdict;
  if (!verdict.registered() || (verdict.overlap_share >= kLeastOverlap &&
                                result.contradiction_share <= kLittleContradiction)) {
    return;
  }
  verdict.outcome = RegistrationOutcome::kDoubtful;
  verdict.decided_by = "no pose prior";
  verdict.reason = absl::StrFormat(
      "without a pose prior its place was found by shape alone: %.0f %% overlap, %.0f %% in "
      "contradiction",
      100 * verdict.overlap_share, 100 * result.contradiction_share);
  verdict.remedy = "accept the pose if it is right, or give a prior pose";
}

RegistrationResult RegisterReturns(const PlanningView& model, const Scan& scan,
                                   const PosePrior& prior, std::span<const TargetTie> targets,
                                   const RegistrationConfig& config, Parallel& parallel) {
  const ScanSurface surface = SampleSurface(scan, config.sample_spacing, parallel);
  // A trusted pose is kept, and compared with where the scan's own evidence puts it: so it must not
  // hold the alignment.
  PosePrior guess = prior;
  if (prior.trusted) {
    guess.trusted = false;
    guess.covariance.reset();
  }
  const Alignment alignment = Align(model, surface, guess, config, parallel, targets);
  RegistrationResult result;
  if (prior.trusted) {
    const RegistrationResult aligned =
        Qualify(model, surface, alignment, guess, config, parallel, targets).result;
    const bool checkable = aligned.correspondences > 0 && aligned.converged;
    Alignment kept = alignment;
    kept.T_world_scan = prior.T_world_scan;
    kept.converged = true;
    kept.rivals.clear();  // the pose was not chosen among minima
    result = Qualify(model, surface, kept, prior, config, parallel, targets).result;
    constexpr double kChiSquare6At999 = 22.46;
    if (checkable && Disagreement(prior, aligned) > kChiSquare6At999 &&
        aligned.verdict.overlap_share >= config.minimum_overlap) {
      const double shift =
          (aligned.T_world_scan.translation() - prior.T_world_scan.translation()).norm();
      result.verdict.outcome = RegistrationOutcome::kDoubtful;
      result.verdict.decided_by = "trusted pose";
      result.verdict.reason = absl::StrFormat(
          "the surfaces fit %.3f m away from the trusted pose, more than its covariance allows",
          shift);
      result.verdict.remedy = "check the control registration, or give its covariance as it is";
    }
  } else {
    result = QualifyNearPrior(model, surface, alignment, prior, config, targets, parallel);
  }
  return result;
}

RegistrationResult RegisterReturnsAnywhere(const PlanningView& model, const Scan& scan,
                                           const PosePrior& near_last,
                                           const RegistrationConfig& config, Parallel& parallel) {
  const ScanSurface surface = SampleSurface(scan, config.sample_spacing, parallel);
  const double h = model.voxel_size();
  const Eigen::AlignedBox3d everywhere(model.bounds().min.cast<double>() * h,
                                       model.bounds().max.cast<double>() * h);
  const CorrespondenceField field(model, everywhere, config.max_correspondence, parallel);
  const VoxelSearch search(model, everywhere);
  const PlaceSearch found = FindPlaces(model, field, surface, config.sample_spacing, parallel);
  std::vector<Eigen::Isometry3d> starts = Starts(near_last);
  starts.insert(starts.begin(), found.places.begin(), found.places.end());
  const Alignment alignment = AlignFrom(model, field, search, surface, near_last,
                                        StartKind::kPlaces, starts, config, parallel);
  PosePrior there;
  there.T_world_scan = alignment.T_world_scan;
  RegistrationResult result = Qualify(model, surface, alignment, there, config, parallel).result;
  DoubtWhatShapeAloneFound(result);
  if (!result.verdict.registered() && !found.why_not.empty()) {
    result.verdict.reason = absl::StrCat("there is no pose prior, and ", found.why_not,
                                         "; near the last station: ", result.verdict.reason);
    result.verdict.remedy = "give a prior pose";
  }
  return result;
}

// What a mirror shows lies behind its wall, in space that other scans know: it contradicts like a
// wrong pose does. To tell it takes half as long as to align, so only a scan in doubt is asked.
template <typename RegisterScan>
RegistrationResult WithMirrorsTold(const Scan& scan, Parallel& parallel,
                                   const RegisterScan& register_scan) {
  RegistrationResult result = register_scan(scan);
  if (result.verdict.registered() || result.contradiction_share <= kLittleContradiction) {
    return result;
  }
  const std::optional<Scan> direct = WithoutReflections(scan, parallel);
  return direct ? register_scan(*direct) : result;
}

}  // namespace

absl::StatusOr<RegistrationResult> Register(const PlanningView& model, const Scan& scan,
                                            const PosePrior& prior,
                                            const RegistrationConfig& config, Parallel& parallel) {
  return RegisterWithTargets(model, scan, prior, {}, config, parallel);
}

absl::StatusOr<RegistrationResult> RegisterWithTargets(const PlanningView& model, const Scan& scan,
                                                       const PosePrior& prior,
                                                       std::span<const TargetTie> targets,
                                                       const RegistrationConfig& config,
                                                       Parallel& parallel) {
  const auto started = std::chrono::steady_clock::now();
  if (absl::Status status = Validate(model, scan, prior, config); !status.ok()) return status;
  if (absl::Status status = ValidateTargets(targets); !status.ok()) return status;
  RegistrationResult result = WithMirrorsTold(scan, parallel, [&](const Scan& returns) {
    return RegisterReturns(model, returns, prior, targets, config, parallel);
  });
  result.seconds = SecondsSince(started);
  return result;
}

absl::StatusOr<RegistrationResult> RegisterAnywhere(const PlanningView& model, const Scan& scan,
                                                    const Eigen::Isometry3d& T_world_last,
                                                    const RegistrationConfig& config,
                                                    Parallel& parallel) {
  const auto started = std::chrono::steady_clock::now();
  PosePrior near_last;
  near_last.T_world_scan = T_world_last;
  if (absl::Status status = Validate(model, scan, near_last, config); !status.ok()) return status;
  RegistrationResult result = WithMirrorsTold(scan, parallel, [&](const Scan& returns) {
    return RegisterReturnsAnywhere(model, returns, near_last, config, parallel);
  });
  result.seconds = SecondsSince(started);
  return result;
}

}  // namespace vantage
