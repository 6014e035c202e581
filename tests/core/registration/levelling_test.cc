// How the first scan is levelled: by inclinometer, floor, walls or prior.
#include "core/registration/levelling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

using testing::HasSubstr;

TEST(LevelTest, TakesTheTiltOutOfTheFirstScan) {
  for (const double pitch : {0.0, 1.0, -4.0, 9.0}) {
    const sensor::Scan scan = ScanScene(
        FurnishedRoom(6),
        PoseAt({0.2, 0.1, 1.3}, 0.7, sensor::Radians(pitch), sensor::Radians(0.4 * pitch)), {}, 17);
    const auto level = LevelFirstScan(scan);
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_TRUE(level->found_floor);
    const Eigen::Vector3d up =
        PoseAt({0, 0, 0}, 0.7, sensor::Radians(pitch), sensor::Radians(0.4 * pitch))
            .linear()
            .transpose() *
        Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(sensor::Degrees(std::acos((level->T_world_scan.linear() * up).z())), 0, 0.05)
        << pitch;
    EXPECT_NEAR(sensor::Degrees(level->tilt), sensor::Degrees(std::acos(up.z())), 0.05);
  }
}

TEST(LevelTest, InclinometerStands) {
  sensor::Scan scan = ScanScene(BareRoom(), PoseAt({0, 0, 1.4}, 0, sensor::Radians(3)), {}, 18);
  sensor::PosePrior prior;
  prior.T_world_scan = PoseAt({5, 6, 7}, 1.2, sensor::Radians(2), 0);
  prior.levelled_sigma = sensor::Radians(0.01);
  scan.prior = prior;
  const auto level = LevelFirstScan(scan);
  ASSERT_TRUE(level.ok());
  EXPECT_TRUE(level->from_inclinometer);
  EXPECT_NEAR(sensor::Degrees(level->tilt), 2, 1e-6);
  // No heading and no place are taken from it.
  EXPECT_TRUE(level->T_world_scan.translation().isZero());
  EXPECT_NEAR(level->T_world_scan.linear()(1, 0), 0, 1e-9);
}

TEST(LevelTest, NoFloorNoRotation) {
  ScanSettings upwards;
  upwards.elevation_min = sensor::Radians(60);  // the ceiling only
  const auto level = LevelFirstScan(ScanScene(BareRoom(), PoseAt({0, 0, 1.4}, 0), upwards, 19));
  ASSERT_TRUE(level.ok());
  EXPECT_FALSE(level->found_floor);
  EXPECT_TRUE(level->T_world_scan.isApprox(Eigen::Isometry3d::Identity()));
  EXPECT_NE(level->message.find("is taken to have stood upright"), std::string::npos);
}

// Upright as far as a floor is looked for: nothing to say. Beyond, and on its side, it is said,
// whichever way it lies.
TEST(LevelTest, WhatIsAssumedOfTheTiltIsSaid) {
  for (const double pitch : {0.0, 9.0, 40.0, 90.0}) {
    for (const double heading : {0.0, 0.7, 0.5 * sensor::kPi, sensor::kPi, 1.5 * sensor::kPi}) {
      SCOPED_TRACE(testing::Message() << pitch << " degrees, heading " << heading);
      for (const bool inclinometer : {false, true}) {
        const Eigen::Isometry3d pose = PoseAt({0.9, -0.6, 1.3}, heading, sensor::Radians(pitch));
        sensor::Scan scan = ScanScene(FurnishedRoom(6), pose, {}, 17);
        if (inclinometer) {
          scan.prior.emplace();
          scan.prior->T_world_scan = pose;
          scan.prior->levelled_sigma = sensor::Radians(0.01);
        }
        const auto level = LevelFirstScan(scan);
        ASSERT_TRUE(level.ok()) << level.status();
        if (pitch < 15) {
          EXPECT_EQ(level->message, "");
        } else if (inclinometer) {
          EXPECT_THAT(level->message, HasSubstr("tilted by"));
        } else if (!level->found_floor) {
          EXPECT_THAT(level->message, HasSubstr("no floor within 15 degrees"));
        } else {
          EXPECT_THAT(level->message, HasSubstr("on its side"));
        }
      }
    }
  }
}

// On its side, a wall at the height of a tripod is no better a floor than what is one.
TEST(LevelTest, AWallAsNearAsAFloorIsSaid) {
  const Eigen::Isometry3d pose = PoseAt({0.9, 0.6, 1.3}, 0, 0, sensor::Radians(90));
  sensor::Scan scan = ScanScene(BareRoom(), pose, {}, 17);
  const auto level = LevelFirstScan(scan);
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_TRUE(level->found_floor);
  EXPECT_TRUE(level->maybe_on_side);
  EXPECT_THAT(level->message, HasSubstr("1.9 m below the scanner, may be a wall"));
  EXPECT_THAT(level->message, HasSubstr("from an upright scanner"));
  EXPECT_THAT(TiltInDoubt(scan), HasSubstr("on its side"));

  // A place without a tilt states nothing of it; a tilt does.
  scan.prior.emplace();
  scan.prior->T_world_scan = PoseAt({0.9, 0.6, 1.3}, 0);
  EXPECT_TRUE(LevelFirstScan(scan)->maybe_on_side);
  scan.prior->T_world_scan = pose;
  const auto stated = LevelFirstScan(scan);
  ASSERT_TRUE(stated.ok()) << stated.status();
  EXPECT_FALSE(stated->maybe_on_side);
  EXPECT_THAT(stated->message, HasSubstr("tilted by 90 degrees"));
  EXPECT_EQ(TiltInDoubt(scan), "");
}

// On its side a wall looks like a floor, but for its distance: said where that is no tripod's.
TEST(LevelTest, AWallThatIsTakenForTheFloorIsSaid) {
  const auto level =
      LevelFirstScan(ScanScene(BareRoom(), PoseAt({0, 0, 1.4}, 0, 0, sensor::Radians(90)), {}, 17));
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_TRUE(level->found_floor);
  EXPECT_NE(level->message.find("2.5 m below the scanner, farther than under any tripod"),
            std::string::npos)
      << level->message;
}

// Scans of meshes, from a scanner that is tilted.
class LevelInMeshTest : public ::testing::Test {
 protected:
  static sensor::Scan ScanOf(const std::function<void(simulation::MeshBuilder&)>& build,
                             const Eigen::Isometry3d& T_world_scan, double noise = 0.003) {
    simulation::TriangleMesh mesh;
    simulation::MeshBuilder builder(mesh);
    build(builder);
    sensor::ScannerModel scanner;
    scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.5);
    scanner.range_noise = noise;
    parallel::Serial serial;
    sensor::Scan scan;
    scan.image = simulation::SimulatedScanner(mesh).Scan(scanner, T_world_scan, {}, 1, serial);
    scan.scanner = scanner;
    return scan;
  }

  // rad, that is left between up and what it was found to be.
  static double Left(const Levelling& level, const Eigen::Isometry3d& T_world_scan) {
    const Eigen::Vector3d up = T_world_scan.linear().transpose() * Eigen::Vector3d::UnitZ();
    return std::acos(std::min(1.0, (level.T_world_scan.linear() * up).z()));
  }

  // A room of 12 x 4 m, a level floor of 3 m and a ramp of `slope` (rad) over the rest.
  static std::function<void(simulation::MeshBuilder&)> RampRoom(double slope) {
    return [slope](simulation::MeshBuilder& builder) {
      const double rise = 9 * std::tan(slope);
      builder.Box({-0.2, -0.2, -0.2}, {12.2, 0, 4});
      builder.Box({-0.2, 4, -0.2}, {12.2, 4.2, 4});
      builder.Box({-0.2, 0, -0.2}, {0, 4, 4});
      builder.Box({12, 0, -0.2}, {12.2, 4, 4});
      builder.Box({0, 0, -0.2}, {3, 4, 0});
      builder.Quad({Eigen::Vector3d(3, 0, 0), Eigen::Vector3d(12, 0, rise),
                    Eigen::Vector3d(12, 4, rise), Eigen::Vector3d(3, 4, 0)});
    };
  }
};

// The ramp is the larger plane. Walls tell which of the two is level.
TEST_F(LevelInMeshTest, ARampIsNotTakenForTheFloor) {
  for (const double slope : {3.0, 5.0, 8.0}) {
    for (const double tilt : {0.0, 4.0}) {
      SCOPED_TRACE(testing::Message() << slope << " degrees, tilted by " << tilt);
      const Eigen::Isometry3d pose =
          PoseAt({1.6, 1.9, 1.5}, 0.4, sensor::Radians(tilt), sensor::Radians(0.5 * tilt));
      for (const double noise : {0.001, 0.01}) {
        const auto level = LevelFirstScan(ScanOf(RampRoom(sensor::Radians(slope)), pose, noise));
        ASSERT_TRUE(level.ok()) << level.status();
        EXPECT_TRUE(level->found_floor);
        EXPECT_LT(sensor::Degrees(Left(*level, pose)), 0.4);
        EXPECT_EQ(level->message, "");
      }
    }
  }
}

// Nothing but the ramp: the walls, and that is said.
TEST_F(LevelInMeshTest, WhereAllFloorSlopesWallsTellAndItIsSaid) {
  const auto build = [](simulation::MeshBuilder& builder) {
    builder.Box({-0.2, -0.2, -0.5}, {10.2, 0, 4});
    builder.Box({-0.2, 0, -0.5}, {0, 6, 4});
    builder.Quad({Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(10, 0, 0.9),
                  Eigen::Vector3d(10, 8, 0.9), Eigen::Vector3d(0, 8, 0)});
  };
  const Eigen::Isometry3d pose = PoseAt({3, 4, 1.8}, 0.4, sensor::Radians(2), 0);
  const auto level = LevelFirstScan(ScanOf(build, pose));
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_LT(sensor::Degrees(Left(*level, pose)), 0.4);
  EXPECT_THAT(level->message, HasSubstr("the floor slopes by 5 degrees"));
}

// One wall does not tell: the ground is level, as ever.
TEST_F(LevelInMeshTest, OneWallDoesNotTell) {
  const auto build = [](simulation::MeshBuilder& builder) {
    builder.Box({-6, 5, -1}, {6, 5.2, 4});
    builder.Box({-6, -6, -0.2}, {6, 5, 0});
  };
  const Eigen::Isometry3d pose = PoseAt({0, 0, 1.6}, 0.4, sensor::Radians(3), 0);
  const auto level = LevelFirstScan(ScanOf(build, pose));
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_LT(sensor::Degrees(Left(*level, pose)), 0.2);
  EXPECT_EQ(level->message, "");
}

// What a prior says of the tilt is where the floor is looked for, however far from upright.
TEST_F(LevelInMeshTest, ATiltThatIsStatedIsWhereTheFloorIsLookedFor) {
  for (const double tilt : {30.0, 90.0, 180.0}) {
    SCOPED_TRACE(tilt);
    const Eigen::Isometry3d pose = PoseAt({0.2, 0.1, 1.3}, 0.7, sensor::Radians(tilt), 0);
    sensor::Scan scan = ScanScene(FurnishedRoom(6), pose, {}, 17);
    scan.prior.emplace();
    // Stated to within a few degrees; the floor tells the rest.
    scan.prior->T_world_scan = PoseAt({0.2, 0.1, 1.3}, 0.7, sensor::Radians(tilt + 4), 0);
    const auto level = LevelFirstScan(scan);
    ASSERT_TRUE(level.ok()) << level.status();
    EXPECT_TRUE(level->found_floor);
    EXPECT_LT(sensor::Degrees(Left(*level, pose)), 0.2);
    EXPECT_NEAR(sensor::Degrees(level->tilt), tilt, 0.2);
  }
}

// Where a prior is sure of its tilt, what slopes is no floor, walls or not.
TEST_F(LevelInMeshTest, ASurePriorNamesTheFloor) {
  const auto build = [](simulation::MeshBuilder& builder) {
    builder.Box({0, 0, -0.2}, {3, 4, 0});
    builder.Quad({Eigen::Vector3d(3, 0, 0), Eigen::Vector3d(12, 0, 1.1),
                  Eigen::Vector3d(12, 4, 1.1), Eigen::Vector3d(3, 4, 0)});
  };
  const Eigen::Isometry3d pose = PoseAt({1.6, 1.9, 1.5}, 0.4, sensor::Radians(1), 0);
  sensor::Scan scan = ScanOf(build, pose);
  const auto alone = LevelFirstScan(scan);
  ASSERT_TRUE(alone.ok()) << alone.status();
  ASSERT_GT(sensor::Degrees(Left(*alone, pose)), 5) << "nothing else tells";
  scan.prior.emplace();
  scan.prior->T_world_scan = PoseAt({1.6, 1.9, 1.5}, 0.4);
  scan.prior->covariance = sensor::Matrix6d::Identity() * std::pow(sensor::Radians(0.5), 2);
  const auto sure = LevelFirstScan(scan);
  ASSERT_TRUE(sure.ok()) << sure.status();
  EXPECT_LT(sensor::Degrees(Left(*sure, pose)), 0.3);
}

// Neither floor nor walls: the prior, not upright.
TEST_F(LevelInMeshTest, WithoutAnythingToSeeThePriorStands) {
  ScanSettings upwards;
  upwards.elevation_min = sensor::Radians(60);
  const Eigen::Isometry3d pose = PoseAt({0, 0, 1.4}, 0, sensor::Radians(6), 0);
  sensor::Scan scan = ScanScene(BareRoom(), pose, upwards, 19);
  scan.prior.emplace();
  scan.prior->T_world_scan = pose;
  const auto level = LevelFirstScan(scan);
  ASSERT_TRUE(level.ok()) << level.status();
  EXPECT_FALSE(level->found_floor);
  EXPECT_LT(Left(*level, pose), 1e-6);
  EXPECT_THAT(level->message, HasSubstr("as its pose prior says"));
}

}  // namespace
}  // namespace vantage::registration
