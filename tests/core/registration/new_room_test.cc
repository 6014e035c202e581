// A scan of a room that nobody has seen, from where a door shows little of what is known: by area
// it may fit a known room better than its own place, and contradicts there.
#include <gtest/gtest.h>

#include <random>

#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/registration/registration.h"
#include "core/sensor/presets.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/registration/box_scene.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

TEST(NewRoom, IsNotTakenForAKnownOneThatItContradicts) {
  parallel::Serial serial;
  const simulation::Scene flat = simulation::FurnishedFlat(201);
  const simulation::SimulatedScanner simulated(flat.mesh);
  const sensor::ScannerModel scanner = sensor::FindPreset("leica-rtc360")->model;
  const auto scan_at = [&](const Eigen::Isometry3d& pose, uint64_t seed) {
    return sensor::Scan{
        simulated.Scan(scanner, pose, {}, seed, serial, sensor::Radians(0.3)), scanner, {}};
  };
  auto model = *model::PartialModel::Create({});
  for (const Eigen::Isometry3d& pose :
       {PoseAt({4.55, 5.75, 1.2}, 0.4), PoseAt({6.95, 5.97, 1.35}, 1.9)}) {
    ASSERT_TRUE(
        model->Insert(absl::StrCat(model->scans().size()), scan_at(pose, 1), pose, serial).ok());
  }
  std::mt19937_64 random(1);
  for (int t = 0; t < test_support::Runs(3); ++t) {
    const Eigen::Isometry3d truth = PoseAt({8.31 + 0.04 * t, 8.12, 1.15}, 0.9 * t);
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(truth, 0.1, sensor::Radians(3), random);
    const auto result = Register(*model->Publish(), scan_at(truth, 10 + t), prior, {}, serial);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.001);
  }
}

}  // namespace
}  // namespace vantage::registration
