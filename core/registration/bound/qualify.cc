#include "core/registration/bound/qualify.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/align_stages.h"
#include "core/registration/align/instrument_residuals.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/bound/judge.h"
#include "core/registration/bound/moved_things.h"
#include "core/registration/bound/prior_consistency.h"
#include "core/registration/bound/rivals.h"

namespace vantage::registration {
namespace {

// Samples, 5 cm apart: an eighth of a square metre. Fewer cannot be judged.
constexpr size_t kFewestCorrespondences = 50;
// Samples: a share of 8 % that contradicts is then known to 0.35 %, one sigma.
constexpr size_t kSpaceSamples = 6000;
// Residuals beyond this many robust standard deviations are not noise; of Gaussian noise 1 in
// 16,000 is.
constexpr double kInlierDeviations = 4.0;
// Noisier residuals than expected widen the bound. Beyond so many times what the noise explains,
// and so much of a voxel (a wrong match is anywhere within one and a half: 0.9 rms), they are no
// noise at all. Holds while the former is less than that: for a noise of up to a quarter of a
// voxel.
constexpr double kResidualFactor = 3.0;
constexpr double kResidualVoxels = 0.4;
// Share of the samples in known space that contradict it (kContradictionDoubtful), beyond which no
// furniture explains it.
constexpr double kContradictionFailed = 0.40;
// Whether things that were moved explain what speaks against `there`, and leave it beside the pose
// of the alignment, which nothing speaks against so clearly.
bool MovedThingsExplain(const model::PlanningView& model, const sensor::Scan& scan,
                        const ScanSurface& surface, double spacing, const Eigen::Isometry3d& there,
                        const Eigen::Isometry3d& here, std::span<const SurfaceSample> samples,
                        std::span<const SampleAgreement> agreements_here,
                        parallel::Parallel& parallel) {
  const VoxelSearch search(model, BoxOf(surface, there));
  const std::vector<SampleAgreement> agreements =
      CompareSamples(model, search, samples, there, parallel);
  if (AgreementOf(samples, agreements).ContradictionShare() > kContradictionFailed) return false;
  const MovedThings moved =
      FindMovedThings(model, scan, surface, spacing, there, samples, agreements, parallel);
  return moved.Explain() &&
         !FindMovedThings(model, scan, surface, spacing, here, samples, agreements_here, parallel)
              .SayMoreThan(moved);
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Residuals {
  std::vector<Constraint> constraints;  // of the inliers
  double cells = 0;                     // samples of the image that they represent
  double rms = 0;                       // m
  double expected = 0;                  // m
  double normal_sigma = 0;              // rad, of the normals used
  double inflation = 1;                 // of the constraints' variances, since residuals show it
};

Residuals Weigh(const std::vector<Correspondence>& found, const RegistrationConfig& config) {
  Residuals result;
  std::vector<double> magnitudes;
  std::vector<double> angles;
  magnitudes.reserve(found.size());
  for (const Correspondence& c : found) magnitudes.push_back(std::abs(c.residual));
  const double gate =
      kInlierDeviations * kMedianToSigma * std::max(Median(magnitudes), kLeastMedianResidual);
  double squared = 0;
  double variance = 0;
  for (const Correspondence& c : found) {
    if (std::abs(c.residual) > gate) continue;
    result.constraints.push_back({c.point, c.normal, c.variance, 1.0, c.residual});
    result.cells += c.cells;
    squared += c.residual * c.residual;
    variance += c.variance;
    angles.push_back(c.normal_angle);
  }
  const auto count = static_cast<double>(std::max<size_t>(1, result.constraints.size()));
  result.rms = std::sqrt(squared / count);
  result.expected = std::sqrt(variance / count);
  // The angle between two noisy normals is Rayleigh distributed; their mean has half its sigma.
  constexpr double kRayleighMedian = 1.1774;
  result.normal_sigma = std::max(config.normal_sigma / std::sqrt(2.0),
                                 0.5 * Median(std::move(angles)) / kRayleighMedian);
  // Residuals noisier than expected widen the covariance, too.
  result.inflation = std::max(1.0, squared / std::max(variance, 1e-12));
  for (Constraint& c : result.constraints) c.variance *= result.inflation;
  return result;
}

// From where a constraint's surface was measured.
struct Ray {
  double range = 0;  // m
  double cos_incidence = 0;
};
Ray RayTo(const Constraint& c, const Eigen::Vector3d& scanner) {
  const Eigen::Vector3d ray = c.position - scanner;
  const double range = ray.norm();
  return {range, range > 0 ? std::abs(c.normal.dot(ray)) / range : 1.0};
}

// What the residuals tell of the instrument that measured them.
PairResiduals ShownOf(std::span<const Constraint> constraints, const Eigen::Vector3d& position,
                      const sensor::ScannerModel& scanner, const RegistrationConfig& config) {
  std::vector<ClassedResidual> residuals;
  residuals.reserve(constraints.size());
  for (const Constraint& c : constraints) {
    const Ray ray = RayTo(c, position);
    const double along = scanner.RangeSigma(ray.range) * ray.cos_incidence;
    residuals.push_back(
        {c.position, c.normal, ray.range, ray.cos_incidence, c.residual, along * along});
  }
  return SumResiduals(residuals, config.correlation_length);
}

// The bound that the same overlap would have if residuals were as the data sheet says, m.
double BoundBySheet(const Residuals& residuals, const PoseKnowledge& known,
                    const RegistrationConfig& config) {
  std::vector<Constraint> constraints = residuals.constraints;
  for (Constraint& c : constraints) {
    c.variance /= residuals.inflation;
    c.residual = 0;
    c.shared_variance = 0;
  }
  return OverlapGeometry(constraints, residuals.normal_sigma, config)
      .Bound(known.EvidenceInformation())
      .bound;
}

PoseKnowledge Known(const OverlapGeometry& geometry, const Eigen::Isometry3d& T_world_scan,
                    const sensor::PosePrior& prior, std::span<const TargetTie> targets) {
  PoseKnowledge known;
  const Eigen::Vector3d position = prior.T_world_scan.translation();
  const bool has_covariance = prior.covariance.has_value();
  if (prior.levelled_sigma.has_value()) {
    known.evidence.push_back(
        {RegistrationBasis::kLevelling, LevelInformation(*prior.levelled_sigma)});
  }
  if (!targets.empty()) {
    known.evidence.push_back({RegistrationBasis::kTargets, geometry.FromTargets(targets)});
  }
  if (prior.trusted && has_covariance) {
    known.evidence.push_back({RegistrationBasis::kTrustedPose,
                              geometry.FromPoseCovariance(*prior.covariance, position)});
  } else if (has_covariance) {
    known.guessed = geometry.FromPoseCovariance(*prior.covariance, position) /
                    PriorVarianceFactor(geometry, T_world_scan, prior);
  }
  return known;
}

// Worsens a verdict; the first reason stays the first.
void Refuse(RegistrationVerdict& verdict, RegistrationOutcome outcome, RegistrationBasis by,
            const std::string& reason, const std::string& remedy) {
  if (static_cast<int>(outcome) > static_cast<int>(verdict.outcome) || verdict.registered()) {
    verdict.outcome = outcome;
    verdict.bases = {by};
  }
  verdict.reason = verdict.reason.empty() ? reason : absl::StrCat(reason, "; ", verdict.reason);
  verdict.remedy = remedy;
}

// m: how far apart two poses put the overlap, at the corners of its box.
double CornersApart(const Eigen::AlignedBox3d& box, const Eigen::Isometry3d& a,
                    const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d change = b * a.inverse();
  double apart = 0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    apart = std::max(apart, (change * corner - corner).norm());
  }
  return apart;
}

// Makes a doubt of rivals, and the bound span them: what is stated has to hold whichever of the
// poses is right, those included that were too many to be compared.
void DoubtForRivals(const Alignment& alignment, const Eigen::AlignedBox3d& overlap,
                    RegistrationResult& result) {
  RegistrationVerdict& verdict = result.verdict;
  const RivalPose& first = result.rival_poses.front();
  double farthest = 0;  // m, of the rivals
  double spans = alignment.open_within + 0.5 * overlap.diagonal().norm() * alignment.open_turn;
  const auto span = [&](const Eigen::Isometry3d& there) {
    spans = std::max(spans, CornersApart(overlap, alignment.T_world_scan, there));
  };
  for (const RivalPose& rival : result.rival_poses) {
    farthest = std::max(farthest, rival.distance);
    spans = std::max(spans, rival.farthest);
    span(rival.T_world_scan);
  }
  for (const Minimum& other : alignment.not_compared) span(other.T_world_scan);
  verdict.error_bound =
      std::isfinite(spans) ? verdict.error_bound + spans : 2 * OverlapGeometry::kUnconstrained;
  verdict.rigorous_bound = std::max(verdict.rigorous_bound, verdict.error_bound);
  std::string reason = absl::StrFormat(
      "another pose %.2f m away fits as well by all that is known (%.0f %% of what this one does)",
      first.distance, 100 * first.fit_share);
  if (result.rival_poses.size() > 1) {
    absl::StrAppendFormat(&reason, ", and so do %d more, up to %.2f m away",
                          result.rival_poses.size() - 1, farthest);
  }
  if (!alignment.not_compared.empty()) {
    absl::StrAppendFormat(&reason, "; %d others were too many to be compared",
                          alignment.not_compared.size());
  } else if (alignment.open_within > 0) {
    reason += "; there may be others, which were too many to be tried";
  }
  Refuse(verdict, RegistrationOutcome::kDoubtful, RegistrationBasis::kRivalPose, reason,
         "say how good the prior pose is, or overlap something that is not the same on both "
         "sides");
}

// The target farthest from its known place, among those whose distance its own uncertainty and that
// of the pose do not explain; null when there is none.
const TargetTie* WrongTarget(const RegistrationResult& result, std::span<const TargetTie> targets,
                             double& metres) {
  constexpr double kChiSquare3At999 = 16.27;  // quantile of three degrees of freedom, 99.9 %
  const TargetTie* wrong = nullptr;
  metres = 0;
  for (const TargetTie& target : targets) {
    const Eigen::Vector3d miss = result.T_world_scan * target.in_scan - target.in_world;
    const Eigen::Vector3d arm = target.in_world - result.centroid;
    Eigen::Matrix<double, 3, 6> moves;
    moves << 0, arm.z(), -arm.y(), 1, 0, 0, -arm.z(), 0, arm.x(), 0, 1, 0, arm.y(), -arm.x(), 0, 0,
        0, 1;
    const Eigen::Matrix3d variance = moves * result.covariance * moves.transpose() +
                                     target.sigma * target.sigma * Eigen::Matrix3d::Identity();
    if (miss.dot(variance.ldlt().solve(miss)) <= kChiSquare3At999 || miss.norm() <= metres)
      continue;
    wrong = &target;
    metres = miss.norm();
  }
  return wrong;
}

}  // namespace

Qualification Qualify(const model::PlanningView& model, const ScanSurface& surface,
                      const Alignment& alignment, const sensor::PosePrior& prior,
                      const RegistrationConfig& config, parallel::Parallel& parallel,
                      std::span<const TargetTie> targets, const sensor::Scan* scan) {
  Qualification qualification;
  RegistrationResult& result = qualification.result;
  result.T_world_scan = alignment.T_world_scan;
  result.converged = alignment.converged;
  result.iterations = alignment.iterations;
  const VoxelSearch search(model, BoxOf(surface, alignment.T_world_scan));
  Residuals residuals =
      Weigh(FindCorrespondences(search, surface, alignment.T_world_scan, config, parallel), config);
  result.correspondences = residuals.constraints.size();
  result.rms_residual = residuals.rms;
  result.expected_residual = residuals.expected;
  const double share =
      surface.image_samples > 0 ? std::min(1.0, residuals.cells / surface.image_samples) : 0.0;
  if (result.correspondences < kFewestCorrespondences) {
    result.centroid = alignment.T_world_scan.translation();
    result.verdict = NoOverlap(share, config);
    return qualification;
  }

  // What the instrument has shown before counts as it does in predictions. Its scatter does not:
  // that of this scan is known.
  const Eigen::Vector3d position = alignment.T_world_scan.translation();
  const InstrumentExcess excess = config.instrument.Excess(config.correlated_sigma);
  if (excess.any) {
    for (Constraint& c : residuals.constraints) {
      const Ray ray = RayTo(c, position);
      c.shared_variance = excess.shared[ResidualClass(ray.range, ray.cos_incidence)];
    }
  }
  const OverlapGeometry geometry(residuals.constraints, residuals.normal_sigma, config);
  const PoseKnowledge known = Known(geometry, alignment.T_world_scan, prior, targets);
  result.centroid = geometry.centroid();
  if (geometry.constrained_directions() < 6) {
    NormalEquations step;
    step.h = geometry.information();
    PriorTerm(prior, targets).AddTo(step, alignment.T_world_scan, geometry.centroid());
    qualification.to_prior = SolveStep(step);
    qualification.open = geometry.Open();
  }
  result.covariance = geometry.Bound(known.EvidenceInformation() + known.guessed).covariance;
  result.verdict = JudgeRegistration(geometry, share, known, config);

  RegistrationVerdict& verdict = result.verdict;
  const bool firm = verdict.judged_bound <= config.required_accuracy;
  const bool enough = verdict.overlap_share >= config.minimum_overlap;
  // The shape holds the scan; how far its residuals lie apart is what makes the bound.
  const bool firm_by_sheet =
      firm || (enough && BoundBySheet(residuals, known, config) <= config.required_accuracy);
  const std::string by_bound = verdict.reason;
  if (result.rms_residual >
      std::max(kResidualFactor * result.expected_residual, kResidualVoxels * model.voxel_size())) {
    Refuse(verdict, RegistrationOutcome::kDoubtful, RegistrationBasis::kResiduals,
           absl::StrFormat("the surfaces lie %.0f mm apart (rms), the noise explains %.0f mm",
                           1000 * result.rms_residual, 1000 * result.expected_residual),
           "check the scanner's noise figures, or whether much was moved between the scans");
  }
  const std::span<const SurfaceSample> in_space(surface.samples.data(),
                                                std::min(kSpaceSamples, surface.samples.size()));
  const std::vector<SampleAgreement> agreements =
      CompareSamples(model, search, in_space, alignment.T_world_scan, parallel);
  const SpaceAgreement space = AgreementOf(in_space, agreements);
  result.contradiction_share = space.ContradictionShare();
  const bool contradicts = result.contradiction_share > kContradictionDoubtful;
  if (contradicts && scan != nullptr && result.contradiction_share <= kContradictionFailed) {
    const MovedThings moved =
        FindMovedThings(model, *scan, surface, config.sample_spacing, alignment.T_world_scan,
                        in_space, agreements, parallel);
    if (moved.Explain()) result.moved_area = moved.contradicting;
  }
  if (result.contradiction_share > kContradictionFailed) {
    // The scan was not made here, however well the overlap would hold it.
    verdict.error_bound = verdict.rigorous_bound = 2 * OverlapGeometry::kUnconstrained;
  }
  if (contradicts && !result.moved_area.has_value()) {
    Refuse(verdict,
           result.contradiction_share > kContradictionFailed ? RegistrationOutcome::kFailed
                                                             : RegistrationOutcome::kDoubtful,
           RegistrationBasis::kContradiction,
           absl::StrFormat("%.0f %% of the scan lies in space known to be empty or behind walls",
                           100 * result.contradiction_share),
           "give a better prior pose, or scan again if people or furniture moved");
  }
  // When the shape leaves a direction open, poses along it fit equally well, which the bound says
  // already.
  if (firm_by_sheet) {
    const SamplesAtBest at_best{in_space, agreements};
    result.rival_poses = OpenRivals(model, surface, alignment, at_best, parallel);
    std::erase_if(result.rival_poses,
                  [&](const RivalPose& rival) { return Refute(targets, rival.T_world_scan); });
    // What speaks against it may have been moved since, and then it fits better than this one.
    if (alignment.displaced.has_value() && result.rival_poses.empty() && scan != nullptr &&
        !Refute(targets, alignment.displaced->T_world_scan) &&
        MovedThingsExplain(model, *scan, surface, config.sample_spacing,
                           alignment.displaced->T_world_scan, alignment.T_world_scan, in_space,
                           agreements, parallel)) {
      result.rival_poses.push_back(RivalOf(alignment.displaced->T_world_scan,
                                           alignment.displaced->score / alignment.score,
                                           alignment.T_world_scan, in_space));
    }
  }
  if (!result.rival_poses.empty()) {
    DoubtForRivals(alignment, geometry.box(), result);
  } else if (!alignment.left_out.empty() && verdict.registered()) {
    Refuse(verdict, RegistrationOutcome::kDoubtful, RegistrationBasis::kNoPosePrior,
           absl::StrCat("it may have been made elsewhere: ", alignment.left_out),
           "accept the pose if it is right, or give a better prior pose");
  }
  double metres = 0;
  if (const TargetTie* wrong = WrongTarget(result, targets, metres); wrong != nullptr) {
    Refuse(verdict, RegistrationOutcome::kDoubtful, RegistrationBasis::kTargets,
           absl::StrFormat("target '%s' lies %.3f m from its place, the surfaces put it elsewhere",
                           wrong->name, metres),
           "check the target's name and coordinates, and that it was not moved");
  }
  if (!alignment.converged) {
    Refuse(verdict, RegistrationOutcome::kFailed, RegistrationBasis::kNotConverged,
           absl::StrFormat("the alignment did not converge within %d steps", alignment.iterations),
           "give a better prior pose");
  }
  // Where nothing else speaks against the pose.
  if (firm_by_sheet && enough && geometry.constrained_directions() == 6 &&
      verdict.reason == by_bound) {
    if (!firm) {
      // However large the bound: the shape holds the scan, so a person can decide.
      verdict.outcome = RegistrationOutcome::kDoubtful;
      verdict.bases = {RegistrationBasis::kResiduals};
      verdict.reason = ResidualsReason(verdict.judged_bound, config);
      verdict.remedy = kLessIsAsked;
    }
    result.residuals = ShownOf(residuals.constraints, position, surface.scanner, config);
  }
  return qualification;
}

}  // namespace vantage::registration
