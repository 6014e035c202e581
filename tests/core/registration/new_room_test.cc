// A scan of a room that nobody has seen, from where a door shows little of what is known: by area
// it may fit a known room better than its own place, and contradicts there.
#include <gtest/gtest.h>

#include <random>

#include "core/sensor/scanner_model.h"
#include "tests/core/registration/box_scene.h"
#include "tests/core/registration/flat_scans.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

TEST(NewRoom, IsNotTakenForAKnownOneThatItContradicts) {
  FlatScans flat(201);
  flat.Insert(PoseAt({4.55, 5.75, 1.2}, 0.4));
  flat.Insert(PoseAt({6.95, 5.97, 1.35}, 1.9));
  std::mt19937_64 random(1);
  for (int t = 0; t < test_support::Runs(3); ++t) {
    const Eigen::Isometry3d truth = PoseAt({8.31 + 0.04 * t, 8.12, 1.15}, 0.9 * t);
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(truth, 0.1, sensor::Radians(3), random);
    const auto result = flat.RegisterAt(truth, prior, 10 + t);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.001);
  }
}

}  // namespace
}  // namespace vantage::registration
