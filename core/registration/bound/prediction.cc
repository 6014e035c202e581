#include "core/registration/bound/prediction.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/registration/align/align.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/bound/direction_words.h"
#include "core/registration/bound/judge.h"

namespace vantage::registration {
namespace {

// One sigma of the tilt of a tripod that is set up by eye, rad. It counts only in the millimetres
// that are shown. So does the heading, whose uncertainty is that of any prior, or as stated.
constexpr double kTiltGuess = 0.05;  // 3 degrees: a bubble's width
// The place that gains most holds on to the model by as little as it may, so without margins those
// whose figures were predicted too well are preferred.
//
// Nine in ten bounds of alignments are within a third of the prediction (a log-normal error of 0.2,
// one sigma, for steps of 0.5 and 1 degree). Of the headings of a sector, of which dozens are
// compared, 1.4 leaves one in twenty beyond the requirement. Scans all around overlap from more
// sides (kBoundMargin).
constexpr double kSectorBoundMargin = 1.4;
// Of 72 scans with the steps of a real instrument nineteen in twenty overlapped by 0.8 of what was
// predicted or more.
constexpr double kOverlapMargin = 1.3;
// From a rough prior an alignment with little overlap runs into another pose, or nowhere: of scans
// all around that were predicted to overlap by less than a quarter 11 of 50 were lost, of 644
// others one (heading known to 5 degrees; client/study/experiments.md). Of sectors a rival is
// foreseen instead.
constexpr double kRoughPriorOverlap = 0.25;
// Who requires less than a tenth takes the risk: no more is asked than so many times that.
constexpr double kMostOfLittle = 2.5;

// A rival explains 85 % of what the best pose does (Qualify()). So a slide as far as an alignment
// looks around its prior (StartsAroundPrior()) has to cost the overlap at least this share.
constexpr double kLeastLost = 0.15;
constexpr double kSlide = 0.4;  // m
// An alignment that starts within so many standard deviations of a prior that says how good it is
// (StartsAroundPrior()), and as near to the pose as this, runs into one minimum: no rival is met.
constexpr double kStartsInSigmas = 2;
constexpr double kOneMinimum = 2 * kApart;  // m
// Headings in as many are what the first stage corrects; of those that are not stated it is taken
// for granted.
constexpr double kOneTurn = sensor::Radians(12);
// What does not overlap finds other surface by chance when a scan slides back to what is known: the
// floor goes on, and walls are parallel. Share, a choice: with twice as much, jobs in flats cover a
// sixth less (core/planning/experiments.md).
constexpr double kFitsByChance = 0.05;

struct Slide {
  sensor::Vector6d direction = sensor::Vector6d::Zero();
  double noticed = 1;  // share of the constraints, by weight
};

// The horizontal slide that the fewest notice: that it moves off their surface, as
// far as poses are told apart.
Slide LeastNoticedSlide(std::span<const Constraint> constraints) {
  constexpr int kDirections = 12;  // 15 degrees apart, about as far as surface notices none
  double total = 0;
  for (const Constraint& c : constraints) total += c.weight;
  Slide least;
  for (int k = 0; k < kDirections; ++k) {
    const double azimuth = sensor::kPi * k / kDirections;
    const Eigen::Vector3d slide = kSlide * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0);
    double noticed = 0;
    for (const Constraint& c : constraints) {
      if (std::abs(c.normal.dot(slide)) > kApart) noticed += c.weight;
    }
    if (noticed / total >= least.noticed) continue;
    least.noticed = noticed / total;
    least.direction.tail<3>() = slide;
  }
  return least;
}

// The overlap that is asked of a prediction: never all of a scan, however much is required.
double AskedOverlap(double required, bool rough_prior) {
  const double with_margin = std::min(kOverlapMargin * required, 0.5 * (1 + required));
  if (!rough_prior) return with_margin;
  return std::max(with_margin, std::min(kRoughPriorOverlap, kMostOfLittle * required));
}

bool PriorsLeaveOneMinimum(const RegistrationConfig& config) {
  return config.prior_sigma > 0 && kStartsInSigmas * config.prior_sigma <= kOneMinimum &&
         kStartsInSigmas * config.prior_heading_sigma <= kOneTurn;
}

// Voxels, two for each direction of a pose: so few of 5 cm are a hand's breadth of wall.
constexpr ptrdiff_t kFewestElements = 12;

struct ExpectedConstraints {
  std::vector<Constraint> constraints;
  double samples = 0;  // of the scan, on the overlap
  bool enough = false;
};

ExpectedConstraints Expect(std::span<const OverlapElement> overlap, double weight,
                           const Eigen::Vector3d& position, const sensor::ScannerModel& scanner,
                           const InstrumentExcess& excess) {
  const double usable = std::cos(scanner.max_incidence);
  ExpectedConstraints expected;
  std::vector<Constraint>& constraints = expected.constraints;
  constraints.reserve(overlap.size());
  for (const OverlapElement& e : overlap) {
    expected.samples += weight * e.samples;
    const Eigen::Vector3d centroid = e.position.cast<double>();
    const Eigen::Vector3d normal = e.normal.cast<double>();
    const Eigen::Vector3d ray = centroid - position;
    const double range = ray.norm();
    const double cos_incidence = -normal.dot(ray) / range;
    // The alignment uses neither grazing samples nor more than one per voxel.
    if (!(cos_incidence > usable)) continue;
    const double sigma = scanner.RangeSigma(range);
    const double along = sigma * cos_incidence;
    const double model = sigma * sigma / std::max<double>(1.0, e.model_samples);
    Constraint c{centroid, normal, along * along + model,
                 weight * std::min<double>(1.0, e.samples)};
    if (excess.any) {
      const size_t of = ResidualClass(range, cos_incidence);
      c.variance += excess.scatter[of];
      c.shared_variance = excess.shared[of];
    }
    constraints.push_back(c);
  }
  expected.enough = std::count_if(constraints.begin(), constraints.end(), [](const Constraint& c) {
                      return c.weight > 0;
                    }) >= kFewestElements;
  return expected;
}

}  // namespace

TargetedPrediction::TargetedPrediction(std::span<const OverlapElement> overlap, double weight,
                                       const Eigen::Vector3d& position,
                                       const sensor::ScannerModel& scanner,
                                       const RegistrationConfig& config) {
  const ExpectedConstraints expected =
      Expect(overlap, weight, position, scanner, config.instrument.Excess(config.correlated_sigma));
  if (expected.enough) geometry_.emplace(expected.constraints, config.normal_sigma, config);
  if (config.levelled_sigma > 0) levelled_ = LevelInformation(config.levelled_sigma);
}

double TargetedPrediction::Bound(std::span<const TargetTie> targets) const {
  if (!geometry_.has_value()) return 2 * OverlapGeometry::kUnconstrained;
  return geometry_->Bound(levelled_ + geometry_->FromTargets(targets)).bound;
}

ExpectedBounds BoundsOf(std::span<const OverlapElement> overlap, double weight,
                        const Eigen::Vector3d& position, const sensor::ScannerModel& scanner,
                        const RegistrationConfig& config) {
  const auto bound_with = [&](const InstrumentExcess& excess) {
    const ExpectedConstraints expected = Expect(overlap, weight, position, scanner, excess);
    if (!expected.enough) return 2 * OverlapGeometry::kUnconstrained;
    const OverlapGeometry geometry(expected.constraints, config.normal_sigma, config);
    return geometry
        .Bound(config.levelled_sigma > 0 ? LevelInformation(config.levelled_sigma)
                                         : sensor::Matrix6d(sensor::Matrix6d::Zero()))
        .bound;
  };
  ExpectedBounds bounds;
  bounds.by_sheet = bound_with({});
  const InstrumentExcess excess = config.instrument.Excess(config.correlated_sigma);
  bounds.bound = excess.any ? bound_with(excess) : bounds.by_sheet;
  return bounds;
}

double AskedShare(const sensor::ScannerModel& scanner, const RegistrationConfig& config) {
  const bool rough = scanner.TurnsAllAround() && !PriorsLeaveOneMinimum(config);
  return std::max(config.minimum_overlap, AskedOverlap(config.minimum_overlap, rough));
}

RegistrationVerdict PredictRegistration(std::span<const OverlapElement> overlap, double weight,
                                        double expected_samples, const Eigen::Vector3d& position,
                                        const sensor::ScannerModel& scanner,
                                        const RegistrationConfig& config,
                                        std::span<const TargetTie> targets) {
  const InstrumentExcess excess = config.instrument.Excess(config.correlated_sigma);
  const ExpectedConstraints expected = Expect(overlap, weight, position, scanner, excess);
  const std::vector<Constraint>& constraints = expected.constraints;
  const double samples = expected.samples;
  const double share = expected_samples > 0 ? std::min(1.0, samples / expected_samples) : 0.0;
  if (!expected.enough) return NoOverlap(share, config);

  const OverlapGeometry geometry(constraints, config.normal_sigma, config);
  PoseKnowledge known;
  if (config.levelled_sigma > 0) {
    known.evidence.push_back(
        {RegistrationBasis::kLevelling, LevelInformation(config.levelled_sigma)});
  }
  if (!targets.empty()) {
    known.evidence.push_back({RegistrationBasis::kTargets, geometry.FromTargets(targets)});
  }
  if (scanner.positioning_error > 0) {
    const double position_sigma = scanner.positioning_error;
    const sensor::Vector6d sigma{
        {kTiltGuess, kTiltGuess,
         config.prior_heading_sigma > 0 ? config.prior_heading_sigma : kVagueTurn, position_sigma,
         position_sigma, position_sigma}};
    known.guessed = geometry.FromPoseCovariance(sigma.cwiseAbs2().asDiagonal(), position);
  }
  const bool all_around = scanner.TurnsAllAround();
  // Two targets refute any other pose of a scanner that stands upright.
  constexpr size_t kPlacedByTargets = 2;
  const bool one_minimum = PriorsLeaveOneMinimum(config) || targets.size() >= kPlacedByTargets;
  const Margins margins{
      .bound = all_around ? kBoundMargin : kSectorBoundMargin,
      .overlap = AskedOverlap(config.minimum_overlap, all_around && !one_minimum)};
  RegistrationVerdict verdict = JudgeRegistration(geometry, share, known, config, margins);
  if (excess.any && margins.bound * verdict.judged_bound > config.required_accuracy &&
      share >= std::max(config.minimum_overlap, margins.overlap) &&
      margins.bound * BoundsOf(overlap, weight, position, scanner, config).by_sheet <=
          config.required_accuracy) {
    // Not the shape is what is wanting.
    verdict.bases = {RegistrationBasis::kResiduals};
    verdict.reason = ResidualsReason(verdict.judged_bound, config);
    verdict.remedy = kLessIsAsked;
  }
  if (all_around || one_minimum) return verdict;
  const Slide slide = LeastNoticedSlide(constraints);
  if (verdict.registered() &&
      share * slide.noticed - kFitsByChance * (1 - share) < kLeastLost * share) {
    const DirectionWords words = DescribeDirection(slide.direction, 0);
    verdict.outcome = RegistrationOutcome::kDoubtful;
    verdict.bases = {RegistrationBasis::kRivalPose};
    verdict.reason = absl::StrFormat(
        "only %.0f %% of the overlap, which is %.0f %% of the scan, would notice %s: another pose "
        "may fit almost as well",
        100 * slide.noticed, 100 * share, words.direction);
    verdict.remedy = words.remedy;
  }
  return verdict;
}

}  // namespace vantage::registration
