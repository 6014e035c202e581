#include <algorithm>
#include <vector>

#include "core/registration/judge.h"
#include "core/registration/prediction.h"

namespace vantage {

RegistrationVerdict PredictRegistration(std::span<const OverlapElement> overlap, double weight,
                                        double expected_samples, const Eigen::Vector3d& position,
                                        const ScannerModel& scanner,
                                        const RegistrationConfig& config) {
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
    known.guaranteed = LevelInformation(config.levelled_sigma);
    known.guarantee = "levelling";
  }
  if (scanner.positioning_error > 0) {
    Matrix6d position_only = Matrix6d::Zero();
    position_only.diagonal().head<3>().setConstant(kPi * kPi);  // any heading
    position_only.diagonal().tail<3>().setConstant(scanner.positioning_error *
                                                   scanner.positioning_error);
    known.guessed = geometry.FromPoseCovariance(position_only, position);
  }
  return Judge(geometry, share, known, config);
}

}  // namespace vantage
