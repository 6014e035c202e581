// Scans in a scene, from priors that are wrong by a known amount, registered to a model of it.
#ifndef VANTAGE_TESTS_BENCH_REGISTRATION_TRIALS_H_
#define VANTAGE_TESTS_BENCH_REGISTRATION_TRIALS_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "core/model/partial_model.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/bound/registration_result.h"
#include "core/sensor/scan.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/repetitive_scenes.h"

namespace vantage::bench {

// Whether a prior says how good it is.
enum class StatedPrior : uint8_t { kGuess, kWithItsSigma };

struct RegistrationTrial {
  registration::RegistrationResult result;
  double off = 0;  // m, from where it was made
};

class RegistrationTrials {
 public:
  static constexpr double kTurnSigma = sensor::Radians(5);  // of the headings of priors
  // With a model of what is seen from `scene.scanned`. Both references are kept.
  RegistrationTrials(const RepetitiveScene& scene, uint64_t seed, parallel::Parallel& parallel);

  const model::PlanningView& view() const { return *view_; }
  const simulation::SimulatedScanner& tracer() const { return tracer_; }
  // A scan from a place, with a prior that is off by `sigma` (m, one sigma of each horizontal axis)
  // and by 5 cm and 5 degrees. The next call draws other errors.
  // `targets`: places (m, world) of targets that the scan sees, to TargetTie's sigma.
  RegistrationTrial Register(const Eigen::Vector3d& place, double sigma, StatedPrior stated,
                             const registration::RegistrationConfig& config,
                             std::span<const Eigen::Vector3d> targets = {}) {
    return RegisterFrom(place, place, sigma, stated, config, targets);
  }
  // The same with a prior of another place.
  RegistrationTrial RegisterFrom(const Eigen::Vector3d& place, const Eigen::Vector3d& told,
                                 double sigma, StatedPrior stated,
                                 const registration::RegistrationConfig& config,
                                 std::span<const Eigen::Vector3d> targets = {});

 private:
  Eigen::Isometry3d PoseAt(const Eigen::Vector3d& place);
  sensor::Scan ScanAt(const simulation::SimulatedScanner& of, const Eigen::Isometry3d& pose,
                      uint64_t seed) const;

  simulation::SimulatedScanner tracer_;
  std::optional<simulation::SimulatedScanner> later_;
  simulation::RandomSequence random_;
  uint64_t seed_;
  parallel::Parallel& parallel_;
  sensor::ScannerModel scanner_;
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  uint64_t scans_ = 0;
};

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_REGISTRATION_TRIALS_H_
