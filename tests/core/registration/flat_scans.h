// A furnished flat, the model of some scans of it, and scans that are registered to that.
#ifndef VANTAGE_TESTS_CORE_REGISTRATION_FLAT_SCANS_H_
#define VANTAGE_TESTS_CORE_REGISTRATION_FLAT_SCANS_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>

#include "absl/status/statusor.h"
#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/registration/registration.h"
#include "core/sensor/scan.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::registration {

// By the preset of a real instrument, in steps of 0.3 degrees.
class FlatScans {
 public:
  explicit FlatScans(uint64_t seed);

  void Insert(const Eigen::Isometry3d& pose);
  // A scan made at `truth`, whose noise `noise_seed` draws.
  absl::StatusOr<RegistrationResult> RegisterAt(const Eigen::Isometry3d& truth,
                                                const sensor::PosePrior& prior,
                                                uint64_t noise_seed);

 private:
  sensor::Scan ScanAt(const Eigen::Isometry3d& pose, uint64_t noise_seed);

  parallel::Serial serial_;
  const simulation::Scene flat_;
  const simulation::SimulatedScanner simulated_;
  const sensor::ScannerModel scanner_;
  const std::unique_ptr<model::PartialModel> model_;
};

}  // namespace vantage::registration

#endif  // VANTAGE_TESTS_CORE_REGISTRATION_FLAT_SCANS_H_
