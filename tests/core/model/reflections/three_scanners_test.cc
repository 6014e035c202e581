// Mirrors and openings are told apart alike at three scanners.
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "core/model/reflections/reflections.h"
#include "core/parallel/parallel.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/core/model/reflections/ended_returns.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

constexpr double kAngleOfDiscontinuity = 0.14;  // rad

class ReflectionsAtThreeScanners : public testing::TestWithParam<test_support::ScannerCase> {
 protected:
  // All around, since what a mirror shows has to be measured behind the scanner; where the mirrors
  // hang.
  ReflectionsAtThreeScanners()
      : scanner_(test_support::Sector(GetParam(), 2 * sensor::kPi, sensor::Radians(40))) {}

  struct Ended : EndedReturns {
    std::vector<Reflector> reflectors;
    EndedReturns farther;  // from 0.45 m behind the mirror on
  };
  Ended EndedReflections(const simulation::Scene& scene, const Eigen::Isometry3d& pose,
                         const simulation::ScanFaults& faults = {}) {
    const simulation::SimulatedScanner simulated(scene.mesh);
    const sensor::RangeImage truth =
        simulated.Scan(scanner_, pose, simulation::ScanFaults::None(), 7, serial_);
    const OpenRangeSurface before(simulated.Scan(scanner_, pose, faults, 7, serial_), scanner_,
                                  kAngleOfDiscontinuity, serial_);
    OpenRangeSurface surface = before;
    std::vector<Reflector> reflectors = EndReflections(surface, serial_);
    return {CountEndedReturns(before, surface, truth), std::move(reflectors),
            CountEndedReturns(before, surface, truth, 0.45F)};
  }

  parallel::Serial serial_;
  sensor::ScannerModel scanner_;
};

TEST_P(ReflectionsAtThreeScanners, AMirrorIsFoundWhereItHangs) {
  const Eigen::Isometry3d pose = PoseAt({3.3, 2.1, 1.5}, 0.2);
  const Ended ended = EndedReflections(simulation::PaneRoom({false, true, false, false}), pose);
  // Of its 1.3 x 1.95 m, 2.07 m away, a part hidden by the table.
  ASSERT_GT(static_cast<double>(ended.reflections) * GetParam().step * GetParam().step, 0.2);
  ASSERT_EQ(ended.reflectors.size(), 1u);
  EXPECT_GT((pose.linear() * ended.reflectors[0].normal).y(), 0.9998);
  EXPECT_NEAR(ended.reflectors[0].distance, 2.07, 0.035);
  EXPECT_LE(ended.missed, ended.reflections / 100);
  // Among them what lies, reflected, right behind the mirror.
  EXPECT_LE(ended.real, ended.reflections / 40);
}

TEST_P(ReflectionsAtThreeScanners, APolishedFloorIsFound) {
  const Eigen::Isometry3d pose = PoseAt({4.7, 2.5, 1.3}, 0.4);
  const Ended ended = EndedReflections(simulation::PaneRoom({false, false, true, false}), pose);
  ASSERT_GT(static_cast<double>(ended.reflections) * GetParam().step * GetParam().step, 0.02);
  ASSERT_EQ(ended.reflectors.size(), 1u);
  EXPECT_GT(ended.reflectors[0].normal.z(), 0.9998);
  EXPECT_NEAR(ended.reflectors[0].distance, 1.3, 0.01);
  EXPECT_LE(ended.missed, ended.reflections / 100);
  EXPECT_LE(ended.real, ended.returns / 1000);
}

// With mirrors that answer like walls: shelves, curtains, and the doorway to the next room.
TEST_P(ReflectionsAtThreeScanners, FurnishedRoomsAndADoorwayHaveNone) {
  simulation::ScanFaults faults;
  faults.mirror_reflections = false;
  const auto expect_none = [&](const simulation::Scene& scene, const Eigen::Vector3d& at) {
    const Ended ended = EndedReflections(scene, PoseAt(at, 0.3, 0.01, 0.02), faults);
    EXPECT_TRUE(ended.reflectors.empty()) << scene.name << " " << at.transpose();
    EXPECT_EQ(ended.real, 0u);
  };
  const simulation::Scene rooms = simulation::TwoRooms(1);
  expect_none(rooms, rooms.starts[0]);
  expect_none(simulation::FurnishedFlat(1), {7.69, 3.10, 1.65});
  expect_none(simulation::FurnishedFlat(4), {7.25, 6.05, 1.49});
  expect_none(simulation::PillarHall(2), {4.85, 2.15, 1.59});
}

// A washstand's, five centimetres before the wall.
TEST_P(ReflectionsAtThreeScanners, AMirrorRightBeforeItsWallIsFound) {
  if (GetParam().step > sensor::Radians(0.75)) GTEST_SKIP() << "goes unnoticed at one degree";
  const Ended ended =
      EndedReflections(simulation::FurnishedFlat(101), PoseAt({9.69, 1.51, 1.85}, 0.3));
  ASSERT_GT(static_cast<double>(ended.reflections) * GetParam().step * GetParam().step, 0.5);
  EXPECT_LE(ended.missed, ended.reflections / 50);
  EXPECT_LE(ended.real, ended.reflections / 20);
}

// In the wall that the mirror hangs on there is the door to another room.
TEST_P(ReflectionsAtThreeScanners, ADoorwayInTheWallOfAMirrorStaysOpen) {
  const Ended ended =
      EndedReflections(simulation::FurnishedFlat(3), PoseAt({2.44, 5.52, 1.05}, 3.4));
  EXPECT_LE(ended.real, ended.returns / 20'000);
  // And the mirror is found, but for what it shows of the wall that it nearly touches.
  ASSERT_GT(static_cast<double>(ended.farther.reflections) * GetParam().step * GetParam().step,
            0.03);
  if (GetParam().step > sensor::Radians(0.75)) return;  // goes unnoticed at one degree
  EXPECT_LE(ended.farther.missed, ended.farther.reflections / 50);
}

// Rooms that are the mirror image of each other, seen through the doorway between them.
TEST_P(ReflectionsAtThreeScanners, SymmetricRoomsThroughADoorwayAreRooms) {
  ClosedFormScene scene;
  scene.air = {{Eigen::Vector3d(-3, -2, 0), Eigen::Vector3d(-0.06, 2, 2.5)},
               {Eigen::Vector3d(0.06, -2, 0), Eigen::Vector3d(3, 2, 2.5)},
               {Eigen::Vector3d(-0.1, -0.5, 0), Eigen::Vector3d(0.1, 0.5, 2)}};
  const sensor::Scan scan =
      test_support::ScanBy(scanner_, PoseAt({-1.2, 0.7, 1.5}, 0.3, 0.01, 0.02), 3,
                           [&](const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
                             return scene.Cast(from, ray, 30);
                           });
  OpenRangeSurface surface(scan.image, scan.scanner, kAngleOfDiscontinuity, serial_);
  EXPECT_TRUE(EndReflections(surface, serial_).empty());
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, ReflectionsAtThreeScanners,
                         testing::ValuesIn(test_support::kThreeScanners));

}  // namespace
}  // namespace vantage::model
