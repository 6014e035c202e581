#include "tests/bench/registration_trials.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/registration/registration.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

constexpr double kUpSigma = 0.05;  // m
constexpr double kTiltSigma = sensor::Radians(1);
constexpr uint64_t kAfterModel = 100;  // seeds of scans, after those of the model

}  // namespace

RegistrationTrials::RegistrationTrials(const RepetitiveScene& scene, uint64_t seed,
                                       parallel::Parallel& parallel)
    : tracer_(scene.mesh),
      random_(simulation::MixBits(seed) ^ 73),
      seed_(seed),
      parallel_(parallel),
      model_(model::PartialModel::Create({}).value()) {
  if (scene.later.has_value()) later_.emplace(*scene.later);
  for (size_t i = 0; i < scene.scanned.size(); ++i) {
    const Eigen::Isometry3d pose = PoseAt(scene.scanned[i]);
    model_->Insert(absl::StrCat(i), ScanAt(tracer_, pose, seed + i), pose, parallel).value();
  }
  view_ = model_->Publish();
}

Eigen::Isometry3d RegistrationTrials::PoseAt(const Vector3d& place) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(place);
  pose.rotate(Eigen::AngleAxisd(random_.Between(0, 2 * sensor::kPi), Vector3d::UnitZ()));
  return pose;
}

sensor::Scan RegistrationTrials::ScanAt(const simulation::SimulatedScanner& of,
                                        const Eigen::Isometry3d& pose, uint64_t seed) const {
  sensor::Scan scan;
  scan.scanner = scanner_;
  scan.image = of.Scan(scanner_, pose, simulation::ScanFaults{}, seed, parallel_);
  return scan;
}

RegistrationTrial RegistrationTrials::RegisterFrom(const Vector3d& place, const Vector3d& told,
                                                   double sigma, StatedPrior stated,
                                                   const registration::RegistrationConfig& config,
                                                   std::span<const Vector3d> targets) {
  const Eigen::Isometry3d truth = PoseAt(place);
  const sensor::Scan scan =
      ScanAt(later_.has_value() ? *later_ : tracer_, truth, seed_ + kAfterModel + scans_);
  const auto normal = [&](uint64_t stream) {
    return simulation::RandomNormal(seed_, scans_, 2 * stream);
  };
  sensor::PosePrior prior;
  prior.T_world_scan = truth;
  prior.T_world_scan.pretranslate(told - place);
  prior.T_world_scan.pretranslate(
      Vector3d(sigma * normal(0), sigma * normal(1), kUpSigma * normal(2)));
  prior.T_world_scan.rotate(Eigen::AngleAxisd(kTurnSigma * normal(3), Vector3d::UnitZ()));
  if (stated == StatedPrior::kWithItsSigma) {
    const sensor::Vector6d sigmas{{kTiltSigma, kTiltSigma, kTurnSigma, sigma, sigma, kUpSigma}};
    prior.covariance = sigmas.cwiseAbs2().asDiagonal();
  }
  std::vector<registration::TargetTie> ties;
  for (const Vector3d& target : targets) {
    registration::TargetTie tie;
    tie.name = absl::StrCat(ties.size());
    const uint64_t stream = 4 + 3 * ties.size();
    tie.in_scan = truth.inverse() * target +
                  tie.sigma * Vector3d(normal(stream), normal(stream + 1), normal(stream + 2));
    tie.in_world = target;
    ties.push_back(std::move(tie));
  }
  ++scans_;
  RegistrationTrial trial;
  trial.result =
      registration::RegisterWithTargets(*view_, scan, prior, ties, config, parallel_).value();
  trial.off = (trial.result.T_world_scan.translation() - truth.translation()).norm();
  return trial;
}

}  // namespace vantage::bench
