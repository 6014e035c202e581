// A scan of a room that nobody has seen, from where a door shows little of what is known: by area
// it may fit a known room better than its own place, and contradicts there.
#include <gtest/gtest.h>

#include <array>
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

// 1.7 m away, within what a guess may be wrong by, a scan fits the known room by half as much again
// as its own place, and a sixth of what meets known space stands in the middle of that room.
TEST(NewRoom, IsNotTakenForAKnownOneThatFitsBetter) {
  FlatScans flat(1);
  double heading = 0;
  for (const Eigen::Vector3d& place : std::array<Eigen::Vector3d, 5>{{{11.45, 2.75, 1.8},
                                                                      {9.87, 4.17, 1.15},
                                                                      {10.57, 5.25, 1.15},
                                                                      {6.39, 5.76, 1.35},
                                                                      {4.05, 5.82, 1.35}}}) {
    flat.Insert(PoseAt(place, heading += 1.1));
  }
  uint64_t noise = 10;
  for (const Eigen::Vector3d& place : std::array<Eigen::Vector3d, 3>{
           {{1.49, 2.44, 1.55}, {1.08, 2.09, 1.35}, {1.39, 3.04, 1.55}}}) {
    const Eigen::Isometry3d truth = PoseAt(place, heading += 1.1);
    sensor::PosePrior prior;
    prior.T_world_scan = truth;
    prior.T_world_scan.translation() += Eigen::Vector3d(0.2, -0.2, 0);
    const auto result = flat.RegisterAt(truth, prior, ++noise);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.002);
  }
}

}  // namespace
}  // namespace vantage::registration
