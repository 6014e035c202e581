// When a job saw rooms and went into them, in a generated flat.
#include "client/study/room_watch.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "client/study/scene_list.h"

namespace vantage::study {
namespace {

using study_records::v1::JobRecord;

class RoomWatchTest : public ::testing::Test {
 protected:
  RoomWatchTest() { watch_.Begin(record_); }

  size_t IndexOf(const std::string& room) const {
    const auto found = std::find_if(site_.rooms.begin(), site_.rooms.end(),
                                    [&](const simulation::Room& r) { return r.name == room; });
    EXPECT_NE(found, site_.rooms.end()) << room;
    return static_cast<size_t>(found - site_.rooms.begin());
  }
  Eigen::Vector3d In(const std::string& room) const {
    const Eigen::Vector2d middle = site_.rooms[IndexOf(room)].inside.center();
    return {middle.x(), middle.y(), site_.floor_height + 1.5};
  }
  const study_records::v1::RoomRecord& Of(const std::string& room) const {
    return record_.rooms(static_cast<int>(IndexOf(room)));
  }
  // The doorway between the hall and another room.
  const simulation::SceneDoorway& DoorOf(const std::string& room) const {
    const auto gap = [&](const simulation::SceneDoorway& door) {
      return std::max(site_.rooms[IndexOf("hall")].inside.exteriorDistance(door.middle),
                      site_.rooms[IndexOf(room)].inside.exteriorDistance(door.middle));
    };
    return *std::min_element(site_.doorways.begin(), site_.doorways.end(),
                             [&](const auto& a, const auto& b) { return gap(a) < gap(b); });
  }

  const simulated_job::Site site_ = BuildScene("flat-1", "").value();
  const simulation::SimulatedScanner tracer_{site_.mesh};
  const sensor::ScannerModel scanner_;
  const RoomWatch watch_{site_, tracer_, scanner_};
  JobRecord record_;
};

TEST_F(RoomWatchTest, EveryDoorwayLiesBetweenTwoRooms) {
  ASSERT_GE(site_.doorways.size(), 4u);
  for (const simulation::SceneDoorway& door : site_.doorways) {
    const auto beside =
        std::count_if(site_.rooms.begin(), site_.rooms.end(), [&](const simulation::Room& room) {
          return room.inside.exteriorDistance(door.middle) < 0.2;
        });
    EXPECT_EQ(beside, 2) << door.middle.transpose();
  }
}

TEST_F(RoomWatchTest, ARoomIsSeenByItsDoorsFloorAndEnteredFromWithin) {
  watch_.Note(In("bedroom"), 1, record_);
  EXPECT_EQ(Of("bedroom").entered(), 1);
  EXPECT_FALSE(Of("bedroom").has_seen()) << "nobody waited for it";
  EXPECT_FALSE(Of("hall").has_entered());

  // Straight before the door, on the hall's side, as far as the blind cone needs.
  const simulation::SceneDoorway& door = DoorOf("bath");
  Eigen::Vector2d across(-door.along.y(), door.along.x());
  if (across.dot(In("hall").head<2>() - door.middle) < 0) across = -across;
  Eigen::Vector3d before = In("hall");
  before.head<2>() = door.middle + 1.0 * across;
  watch_.Note(before, 3, record_);
  EXPECT_EQ(Of("bath").seen(), 3);
  EXPECT_FALSE(Of("bath").has_entered());
  EXPECT_EQ(Of("hall").entered(), 3);

  Eigen::Vector3d in_doorway = before;
  in_doorway.head<2>() = door.middle;
  watch_.Note(in_doorway, 4, record_);
  EXPECT_FALSE(Of("bath").has_entered()) << "that is in neither room";

  watch_.Note(In("bath"), 6, record_);
  watch_.Note(In("bath"), 7, record_);
  EXPECT_EQ(Of("bath").seen(), 3) << "the first of them";
  EXPECT_EQ(Of("bath").entered(), 6);
}

TEST_F(RoomWatchTest, WallsHideDoors) {
  watch_.Note(In("bath"), 1, record_);
  EXPECT_FALSE(Of("living room").has_seen() && Of("bedroom").has_seen() && Of("hall").has_seen() &&
               Of("child's room").has_seen())
      << "not all doors are in view of one room";
}

// A door's floor right below a scanner lies in its blind cone.
TEST_F(RoomWatchTest, TheBlindConeHidesFloor) {
  sensor::ScannerModel level = scanner_;
  level.elevation_min = sensor::Radians(-5);
  const RoomWatch watch(site_, tracer_, level);
  JobRecord record;
  watch.Begin(record);
  watch.Note(In("hall"), 1, record);
  for (const study_records::v1::RoomRecord& room : record.rooms()) {
    EXPECT_FALSE(room.has_seen()) << room.name();
  }
  watch_.Note(In("hall"), 1, record_);
  EXPECT_TRUE(std::any_of(record_.rooms().begin(), record_.rooms().end(),
                          [](const auto& room) { return room.has_seen(); }));
}

TEST(RoomWatchWithoutPlanTest, KnowsOfNoRooms) {
  simulated_job::Site site = BuildScene("flat-1", "").value();
  site.rooms.clear();
  site.doorways.clear();
  const simulation::SimulatedScanner tracer(site.mesh);
  const sensor::ScannerModel scanner;
  const RoomWatch watch(site, tracer, scanner);
  JobRecord record;
  watch.Begin(record);
  watch.Note(site.start, 1, record);
  EXPECT_EQ(record.rooms_size(), 0);
}

}  // namespace
}  // namespace vantage::study
