// Tests that one scan is enough to tell reflections in mirrors and polished floors from rooms.
#include "core/model/reflections/reflections.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "core/model/scan/scan_planes.h"
#include "core/parallel/parallel.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scan_file.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/pane_room.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/core/model/reflections/ended_returns.h"

namespace vantage::model {
namespace {

constexpr double kDiscontinuity = 0.14;  // rad
const Eigen::AlignedBox3d kPaneRoom(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(5.2, 4.2, 2.6));

parallel::Serial& OneThread() {
  static parallel::Serial serial;
  return serial;
}

sensor::ScannerModel Scanner() {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.3);
  return scanner;
}

sensor::RangeImage ScanOf(const simulation::Scene& scene, const Eigen::Isometry3d& pose) {
  parallel::Serial serial;
  return simulation::SimulatedScanner(scene.mesh).Scan(Scanner(), pose, {}, 7, serial);
}

// Returns that lie where `is_there` says so, of points in the scene.
template <typename IsThere>
size_t ReturnsWhere(const RangeSurface& surface, const Eigen::Isometry3d& pose,
                    const IsThere& is_there) {
  size_t returns = 0;
  for (int c = 0; c < surface.columns(); ++c) {
    for (int r = 0; r < surface.rows(); ++r) {
      if (!surface.Returned(c, r)) continue;
      const Eigen::Vector3d p =
          pose * (static_cast<double>(surface.at(c, r)) * surface.Direction(c, r));
      returns += is_there(p) ? 1 : 0;
    }
  }
  return returns;
}

// Returns that lie more than a voxel outside the room: reflections, since there is nothing.
size_t ReflectedReturns(const RangeSurface& surface, const Eigen::Isometry3d& pose) {
  const Eigen::AlignedBox3d room(kPaneRoom.min().array() - 0.05, kPaneRoom.max().array() + 0.05);
  return ReturnsWhere(surface, pose, [&](const Eigen::Vector3d& p) { return !room.contains(p); });
}

size_t Returns(const RangeSurface& surface) {
  size_t returns = 0;
  for (int c = 0; c < surface.columns(); ++c) {
    for (int r = 0; r < surface.rows(); ++r) returns += surface.Returned(c, r) ? 1 : 0;
  }
  return returns;
}

struct Station {
  Eigen::Vector3d at;
  double yaw;
};
std::vector<Station> Stations() {
  return {{{3.3, 2.1, 1.5}, 0}, {{1.1, 1.9, 1.7}, 1}, {{3.1, 0.5, 1.7}, 2}, {{2.7, 3.2, 1.3}, -1}};
}

TEST(ReflectionsTest, AMirrorIsFoundWhereItHangsAndItsReflectionsEndThere) {
  for (const Station& station : Stations()) {
    SCOPED_TRACE(testing::Message() << station.at.transpose());
    const Eigen::Isometry3d pose = PoseAt(station.at, station.yaw);
    const simulation::Scene scene = simulation::PaneRoom({false, true, false, false});
    OpenRangeSurface surface(ScanOf(scene, pose), Scanner(), kDiscontinuity, OneThread());
    const size_t before = ReflectedReturns(surface, pose);
    const size_t returns = Returns(surface);
    ASSERT_GT(before, 2000u);
    const std::vector<Reflector> reflectors = EndReflections(surface, OneThread());
    ASSERT_EQ(reflectors.size(), 1u);
    const Eigen::Vector3d normal = pose.linear() * reflectors[0].normal;
    EXPECT_GT(normal.y(), 0.9998);
    EXPECT_NEAR(reflectors[0].distance, station.at.y() - 0.03, 0.035);
    EXPECT_LE(ReflectedReturns(surface, pose), before / 500);
    // What is there stays.
    EXPECT_LE(returns - Returns(surface), before + before / 200);
    // The rays end in the mirror, and say that nothing came back.
    const Eigen::Vector3d middle = Eigen::Vector3d(3.05, 0.03, 1.2) - station.at;
    const RangeSurface::Reading reading = surface.Read(pose.linear().transpose() * middle);
    EXPECT_NEAR(reading.range, middle.norm(), 0.06);  // 3 cm off, askew
    EXPECT_EQ(reading.beyond, UnknownReason::kHole);
  }
}

// Over the chest at the end of a hall, turned by nearly a degree against the wall behind it: eleven
// metres of hall seem to lie there.
TEST(ReflectionsTest, AMirrorThatHangsAskewIsFound) {
  const simulation::Scene scene = simulation::FurnishedFlat(1);
  const Eigen::AlignedBox3d flat = scene.mesh.Bounds();
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(10.89, 6.19, 1.15), {10.89, 5.9, 1.5}}) {
    SCOPED_TRACE(testing::Message() << at.transpose());
    const Eigen::Isometry3d pose = PoseAt(at, 0.3);
    OpenRangeSurface surface(ScanOf(scene, pose), Scanner(), kDiscontinuity, OneThread());
    const auto beyond = [&] {
      return ReturnsWhere(surface, pose, [&](const Eigen::Vector3d& p) {
        return p.x() > flat.max().x() + 0.1 && p.y() < 8;
      });
    };
    const size_t before = beyond();
    ASSERT_GT(before, 2000u);
    EXPECT_FALSE(EndReflections(surface, OneThread()).empty());
    EXPECT_LE(beyond(), before / 50);
  }
}

EndedReturns EndedReflections(const simulation::Scene& scene, const Eigen::Isometry3d& pose,
                              float well_behind = 0.15F) {
  const simulation::SimulatedScanner simulated(scene.mesh);
  const sensor::RangeImage truth =
      simulated.Scan(Scanner(), pose, simulation::ScanFaults::None(), 7, OneThread());
  const OpenRangeSurface before(ScanOf(scene, pose), Scanner(), kDiscontinuity, OneThread());
  OpenRangeSurface surface = before;
  EndReflections(surface, OneThread());
  return CountEndedReturns(before, surface, truth, well_behind);
}

// A mirror over a washstand, five centimetres in front of the wall. When the wall's own returns
// were questioned, too, they joined the reflection, which then was not recognised, and two metres
// of the next room were cut off.
TEST(ReflectionsTest, AMirrorRightBeforeItsWallIsFound) {
  const simulation::Scene scene = simulation::FurnishedFlat(101);
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(9.69, 1.51, 1.85), {9.41, 1.36, 1.35}}) {
    SCOPED_TRACE(testing::Message() << at.transpose());
    const EndedReturns ended = EndedReflections(scene, PoseAt(at, 0.3));
    ASSERT_GT(ended.reflections, 20'000u);
    EXPECT_LE(ended.missed, ended.reflections / 50);
    EXPECT_LE(ended.real, ended.reflections / 20);
  }
}

// The wall with the mirror has a door to another room. If the door were taken for part of the
// mirror, that room would be hidden from every scan.
TEST(ReflectionsTest, ADoorwayInTheWallOfAMirrorIsNone) {
  const simulation::Scene scene = simulation::FurnishedFlat(3);
  const Eigen::Isometry3d pose = PoseAt(Eigen::Vector3d(2.44, 5.52, 1.05), 3.4);
  const EndedReturns ended = EndedReflections(scene, pose);
  ASSERT_GT(ended.reflections, 1500u);
  EXPECT_LE(ended.real, 10u);
  // A third of them stays: what the mirror shows of the wall that it nearly touches at one edge,
  // within 0.45 m behind it. It goes on to that wall, and so breaks off nowhere.
  EXPECT_LE(ended.missed, 34 * ended.reflections / 100);
  const EndedReturns farther = EndedReflections(scene, pose, 0.45F);
  ASSERT_GT(farther.reflections, 1000u);
  EXPECT_LE(farther.missed, farther.reflections / 100);
}

TEST(ReflectionsTest, APolishedFloorIsFound) {
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(4.7, 2.5, 1.3), {0.5, 2.5, 1.5}}) {
    SCOPED_TRACE(testing::Message() << at.transpose());
    const Eigen::Isometry3d pose = PoseAt(at, 0.4);
    OpenRangeSurface surface(ScanOf(simulation::PaneRoom({false, false, true, false}), pose),
                             Scanner(), kDiscontinuity, OneThread());
    const size_t before = ReflectedReturns(surface, pose);
    ASSERT_GT(before, 1000u);
    const std::vector<Reflector> reflectors = EndReflections(surface, OneThread());
    ASSERT_EQ(reflectors.size(), 1u);
    EXPECT_GT(reflectors[0].normal.z(), 0.9998);
    EXPECT_NEAR(reflectors[0].distance, at.z(), 0.01);
    EXPECT_LE(ReflectedReturns(surface, pose), before / 200);
  }
}

TEST(ReflectionsTest, APlainRoomHasNone) {
  const simulation::Scene scene = simulation::PaneRoom({true, false, false, true});
  std::vector<Station> stations = Stations();
  stations.push_back({{1.7, 1.5, 1.7}, 0});
  stations.push_back({{2.7, 0.5, 1.7}, 0.5});
  stations.push_back({{4.1, 3.1, 1.7}, 0.2});
  for (const Station& station : stations) {
    const Eigen::Isometry3d pose = PoseAt(station.at, station.yaw);
    OpenRangeSurface surface(ScanOf(scene, pose), Scanner(), kDiscontinuity, OneThread());
    const size_t returns = Returns(surface);
    EXPECT_TRUE(EndReflections(surface, OneThread()).empty()) << station.at.transpose();
    EXPECT_EQ(Returns(surface), returns);
  }
}

struct Place {
  simulation::Scene scene;
  std::vector<Eigen::Vector3d> stations;
};
// Shelves, curtains, doorways and pillars in the middle of a hall, which are nearly reflections,
// and mirrors that return rays like walls.
TEST(ReflectionsTest, NoneInFurnishedScenesWithoutMirrors) {
  std::vector<Place> places = {
      {simulation::FurnishedFlat(1), {{7.69, 3.10, 1.65}, {9.05, 4.25, 1.67}}},
      {simulation::FurnishedFlat(3), {{3.35, 5.75, 1.45}, {3.05, 5.75, 1.41}}},
      {simulation::FurnishedFlat(4), {{7.25, 6.05, 1.49}}},
      {simulation::FurnishedFlat(27), {{6.35, 5.75, 1.59}}},
      {simulation::PillarHall(2), {{4.85, 2.15, 1.59}}},
      {simulation::OfficeStorey(1, 300), {}},
      {simulation::TwoRooms(1), {}}};
  simulation::ScanFaults faults;
  faults.mirror_reflections = false;
  parallel::Serial serial;
  for (Place& place : places) {
    const simulation::SimulatedScanner simulated(place.scene.mesh);
    place.stations.push_back(place.scene.starts[0]);
    for (const Eigen::Vector3d& at : place.stations) {
      const Eigen::Isometry3d pose = PoseAt(at, 0.3, 0.01, 0.02);
      OpenRangeSurface surface(simulated.Scan(Scanner(), pose, faults, 7, serial), Scanner(),
                               kDiscontinuity, OneThread());
      EXPECT_TRUE(EndReflections(surface, OneThread()).empty())
          << place.scene.name << " " << at.transpose();
    }
  }
}

TEST(ReflectionsTest, NoneInRealScans) {
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  if (data == nullptr) GTEST_SKIP() << "VANTAGE_SHARED_DATA is not set: no real scans to read";
  for (const std::string name : {"room_scan1", "room_scan2"}) {
    const std::string file = std::string(data) + "/pcl_room_scan/" + name + ".ptx";
    if (!std::ifstream(file)) GTEST_SKIP() << file << " is not there: no real scans to read";
    const auto scan = sensor::ReadScanFile(file, sensor::ImportLimits());
    ASSERT_TRUE(scan.ok()) << scan.status();
    OpenRangeSurface surface(scan->image, scan->scanner, kDiscontinuity, OneThread());
    EXPECT_TRUE(EndReflections(surface, OneThread()).empty()) << name;
  }
}

// Rooms that are the mirror image of each other, seen through the doorway between them: floors,
// ceilings, side walls and the far wall all fit a reflection. The doorway's depth does not.
TEST(ReflectionsTest, SymmetricRoomsThroughADoorwayAreRooms) {
  ClosedFormScene scene;
  scene.air = {{Eigen::Vector3d(-3, -2, 0), Eigen::Vector3d(-0.06, 2, 2.5)},
               {Eigen::Vector3d(0.06, -2, 0), Eigen::Vector3d(3, 2, 2.5)},
               {Eigen::Vector3d(-0.1, -0.5, 0), Eigen::Vector3d(0.1, 0.5, 2)}};
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(-1.5, 0, 1.5), {-1.2, 0.7, 1.5}, {-0.6, 0.2, 1.6}, {-2.3, -1.4, 1.4}}) {
    const sensor::Scan scan = ScanScene(scene, PoseAt(at, 0.3, 0.01, 0.02), {.noise = 0.003});
    OpenRangeSurface surface(scan.image, scan.scanner, kDiscontinuity, OneThread());
    EXPECT_TRUE(EndReflections(surface, OneThread()).empty()) << at.transpose();
  }
}

TEST(ReflectionsTest, NoneInAnyClosedFormScene) {
  for (const ClosedFormScene& scene : AllScenes()) {
    for (const Eigen::Vector3d& station : scene.stations) {
      const sensor::Scan scan = ScanScene(scene, PoseAt(station, 0.3), {.noise = 0.003});
      OpenRangeSurface surface(scan.image, scan.scanner, kDiscontinuity, OneThread());
      const std::vector<Reflector> found = EndReflections(surface, OneThread());
      EXPECT_TRUE(found.empty()) << scene.name << " " << station.transpose() << ": "
                                 << found[0].normal.transpose() << " at " << found[0].distance
                                 << ", " << found[0].cells;
    }
  }
}

TEST(ReflectionsTest, PlanesOfARoomAreFoundWhereTheyAre) {
  const ClosedFormScene scene = EmptyRoom();
  const Eigen::Vector3d at = scene.stations[0];
  const sensor::Scan scan = ScanScene(scene, PoseAt(at), {.noise = 0.003});
  const RangeSurface surface(scan.image, scan.scanner, kDiscontinuity, OneThread());
  const std::vector<ScanPlane> planes = FindScanPlanes(surface, 10, OneThread());
  ASSERT_EQ(planes.size(), 6u);
  const Eigen::AlignedBox3d room = scene.air[0];
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      const double expected = side > 0 ? room.max()[axis] - at[axis] : at[axis] - room.min()[axis];
      size_t found = 0;
      for (const ScanPlane& plane : planes) {
        if (plane.normal[axis] * side > -0.9999) continue;
        ++found;
        EXPECT_NEAR(plane.distance, expected, 0.003);
      }
      EXPECT_EQ(found, 1u) << axis << " " << side;
    }
  }
}

}  // namespace
}  // namespace vantage::model
