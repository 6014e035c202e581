#include "core/registration/bound/prediction.h"

#include <algorithm>
#include <vector>

#include "core/registration/align/pose_step.h"
#include "core/registration/bound/judge.h"

namespace vantage::registration {
namespace {

// One sigma of the tilt of a tripod that is set up by eye, rad. It counts only in the millimetres
// that are shown. So does the heading, whose uncertainty is that of any prior.
constexpr double kTiltGuess = 0.05;  // 3 degrees: a bubble's width

}  // namespace

RegistrationVerdict PredictRegistration(std::span<const OverlapElement> overlap, double weight,
                                        double expected_samples, const Eigen::Vector3d& position,
                                        const sensor::ScannerModel& scanner,
                                        const RegistrationConfig& config) {
  // Voxels, two for each direction of a pose: so few of 5 cm are a hand's breadth of wall.
  constexpr size_t kFewestElements = 12;
  const double usable = std::cos(scanner.max_incidence);
  std::vector<Constraint> constraints;
  constraints.reserve(overlap.size());
  double samples = 0;
  for (const OverlapElement& e : overlap) {
    samples += weight * e.samples;
    const Eigen::Vector3d centroid = e.position.cast<double>();
    const Eigen::Vector3d normal = e.normal.cast<double>();
    const Eigen::Vector3d ray = centroid - position;
    const double range = ray.norm();
    const double cos_incidence = -normal.dot(ray) / range;
    // The alignment uses neither grazing samples nor more than one per voxel.
    if (!(cos_incidence > usable) || !(e.samples > 0)) continue;
    const double sigma = scanner.RangeSigma(range);
    const double along = sigma * cos_incidence;
    const double model = sigma * sigma / std::max<double>(1.0, e.model_samples);
    constraints.push_back(
        {centroid, normal, along * along + model, weight * std::min<double>(1.0, e.samples)});
  }
  const double share = expected_samples > 0 ? std::min(1.0, samples / expected_samples) : 0.0;
  if (constraints.size() < kFewestElements) return NoOverlap(share, config);

  const OverlapGeometry geometry(constraints, config.normal_sigma, config);
  PoseKnowledge known;
  if (config.levelled_sigma > 0) {
    known.evidence.push_back(
        {RegistrationBasis::kLevelling, LevelInformation(config.levelled_sigma)});
  }
  if (scanner.positioning_error > 0) {
    const double position_sigma = scanner.positioning_error;
    const sensor::Vector6d sigma{
        {kTiltGuess, kTiltGuess, kVagueTurn, position_sigma, position_sigma, position_sigma}};
    known.guessed = geometry.FromPoseCovariance(sigma.cwiseAbs2().asDiagonal(), position);
  }
  return JudgeRegistration(geometry, share, known, config);
}

}  // namespace vantage::registration
