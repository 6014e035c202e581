#include "tests/core/registration/flat_scans.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"
#include "core/sensor/presets.h"
#include "core/simulation/scenes/furnished_flat.h"

namespace vantage::registration {

FlatScans::FlatScans(uint64_t seed)
    : flat_(simulation::FurnishedFlat(seed)),
      simulated_(flat_.mesh),
      scanner_(sensor::FindPreset("leica-rtc360")->model),
      model_(*model::PartialModel::Create({})) {}

void FlatScans::Insert(const Eigen::Isometry3d& pose) {
  const std::string name = absl::StrCat(model_->scans().size());
  ASSERT_TRUE(model_->Insert(name, ScanAt(pose, 1), pose, serial_).ok());
}

absl::StatusOr<RegistrationResult> FlatScans::RegisterAt(const Eigen::Isometry3d& truth,
                                                         const sensor::PosePrior& prior,
                                                         uint64_t noise_seed) {
  return Register(*model_->Publish(), ScanAt(truth, noise_seed), prior, {}, serial_);
}

sensor::Scan FlatScans::ScanAt(const Eigen::Isometry3d& pose, uint64_t noise_seed) {
  return {
      simulated_.Scan(scanner_, pose, {}, noise_seed, serial_, sensor::Radians(0.3)), scanner_, {}};
}

}  // namespace vantage::registration
