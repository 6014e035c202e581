// Openings of rooms given as formulas, seen from one station.
#include "core/planning/openings/openings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/measure_coverage.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;

constexpr double kWall = 4.0;       // m, x of the wall's near face
constexpr double kThick = 0.1;      // m
constexpr double kCeiling = 2.7;    // m
constexpr double kTwoVoxels = 0.1;  // m

struct Hole {
  double low = 1.5;  // m, y
  double high = 2.4;
  double sill = 0;
  double head = 2.0;
};

// Two rooms of 4 x 4 m with a wall between them, and holes in it. The station stands in the first;
// of the second, what it sees through the holes is known.
class OpeningsTest : public ::testing::Test {
 protected:
  OpeningsTest() { station_ = Vector3d(2, 2, 1.5); }

  test_support::ClosedFormScene Scene() const {
    test_support::ClosedFormScene scene;
    scene.extent = Region(Vector3d(-0.1, -0.1, -0.1), Vector3d(8.2, 4.1, kCeiling + 0.1));
    const std::vector<Hole> holes = holes_;
    const auto in_hole = [=](double y, double z) {
      for (const Hole& hole : holes) {
        if (y > hole.low && y < hole.high && z > hole.sill && z < hole.head) return true;
      }
      return false;
    };
    const auto furniture = furniture_;
    const Vector3d station = station_;
    const bool all = all_known_;
    scene.solid = [=](const Vector3d& p) {
      if (p.x() < 0 || p.x() > 8.1 || p.y() < 0 || p.y() > 4 || p.z() < 0 || p.z() > kCeiling) {
        return true;
      }
      if (p.x() > kWall && p.x() < kWall + kThick) return !in_hole(p.y(), p.z());
      return furniture(p);
    };
    const double unknown_from = unknown_from_;
    scene.known = [=](const Vector3d& p) {
      if (p.x() > unknown_from) return false;
      if (all || p.x() < kWall + kThick) return true;
      // Through both faces of the wall.
      for (const double face : {kWall, kWall + kThick}) {
        const Vector3d at =
            station + (p - station) * ((face - station.x()) / (p.x() - station.x()));
        if (!in_hole(at.y(), at.z())) return false;
      }
      return true;
    };
    // What is not known is not known to be solid either.
    scene.solid = [solid = scene.solid, known = scene.known](const Vector3d& p) {
      return known(p) && solid(p);
    };
    scene.stations = {test_support::MakeStation(station_)};
    if (second_station_) scene.stations.push_back(test_support::MakeStation(Vector3d(6, 2, 1.5)));
    return scene;
  }
  Openings Find() const {
    const model::PlanningView view = test_support::BuildView(Scene());
    return FindOpenings(view, FloorMap::Find(view, std::nullopt).value()).value();
  }

  std::vector<Hole> holes_ = {Hole{}};
  std::function<bool(const Vector3d&)> furniture_ = [](const Vector3d&) { return false; };
  Vector3d station_;
  bool all_known_ = false;
  double unknown_from_ = 100;  // m, x
  bool second_station_ = false;
};

TEST_F(OpeningsTest, ADoorwayIsFoundWithItsSizeAndLeadsToARoomThatWasNotEntered) {
  for (const double width : {0.6, 0.9, 1.6}) {
    holes_ = {Hole{2.0 - width / 2, 2.0 + width / 2, 0, 2.0}};
    const Openings found = Find();
    ASSERT_EQ(found.openings.size(), 1u) << width;
    const Opening& door = found.openings[0];
    EXPECT_TRUE(door.doorway());
    EXPECT_NEAR(door.width, width, kTwoVoxels);
    EXPECT_NEAR(door.height(), 2.0, kTwoVoxels);
    EXPECT_EQ(door.sill, 0);
    EXPECT_NEAR(door.centre.x(), kWall + kThick / 2, kTwoVoxels);
    EXPECT_NEAR(door.centre.y(), 2, kTwoVoxels);
    EXPECT_NEAR(door.centre.z(), 0, kTwoVoxels);
    EXPECT_GT(door.direction.x(), 0.99);
    EXPECT_LT(door.standing.x(), kWall);
    EXPECT_NEAR((door.standing - door.centre).norm(), 0.6, 0.2);
    EXPECT_EQ(door.storey, 0);
    EXPECT_TRUE(found.spaces[static_cast<size_t>(door.from)].entered);
    EXPECT_TRUE(found.LeadsToUnknown(door));
    EXPECT_EQ(found.RoomsNotEntered(), 1);
  }
}

// From beside the wall so little is seen behind a doorway that no space is known there; where it is
// can be told, and that somebody can go in.
TEST_F(OpeningsTest, ADoorwayIsGlimpsedFromAlongItsWall) {
  for (const double width : {0.8, 0.9, 1.4}) {
    SCOPED_TRACE(width);
    holes_ = {Hole{2.0, 2.0 + width, 0, 2.0}};
    station_ = Vector3d(3.7, 0.3, 1.5);
    const Openings found = Find();
    ASSERT_EQ(found.openings.size(), 1u);
    const Opening& door = found.openings[0];
    EXPECT_TRUE(door.glimpsed);
    EXPECT_TRUE(door.doorway());
    EXPECT_TRUE(door.lintel);
    EXPECT_NEAR(door.width, width, kTwoVoxels);
    EXPECT_NEAR(door.height(), 2.0, kTwoVoxels);
    EXPECT_NEAR(door.centre.x(), kWall, 2 * kTwoVoxels);
    EXPECT_NEAR(door.centre.y(), 2 + width / 2, kTwoVoxels);
    EXPECT_GT(door.direction.x(), 0.99);
    EXPECT_LT(door.standing.x(), kWall);
    EXPECT_TRUE(found.spaces[static_cast<size_t>(door.from)].entered);
    EXPECT_TRUE(found.LeadsToUnknown(door));
    EXPECT_EQ(found.RoomsNotEntered(), 1);
  }
}

// Whether two doorways that were only glimpsed lead into two rooms or into one is not known.
TEST_F(OpeningsTest, GlimpsedDoorwaysAreOneRoomAtLeast) {
  holes_ = {Hole{1.6, 2.4, 0, 2.0}, Hole{2.9, 3.7, 0, 2.0}};
  station_ = Vector3d(3.7, 0.3, 1.5);
  const Openings found = Find();
  ASSERT_EQ(found.openings.size(), 2u);
  for (const Opening& door : found.openings) EXPECT_TRUE(door.glimpsed);
  EXPECT_EQ(found.RoomsNotEntered(), 1);
}

// The shadow beside a cupboard at the wall, the one behind a column, and a window.
TEST_F(OpeningsTest, NoShadowAndNoWindowIsAGlimpsedDoorway) {
  station_ = Vector3d(3.7, 0.3, 1.5);
  holes_ = {};
  for (const double top : {1.9, kCeiling}) {
    furniture_ = [=](const Vector3d& p) {
      return p.x() > 3.2 && p.x() < 3.6 && p.y() > 1.4 && p.y() < 1.8 && p.z() < top;
    };
    EXPECT_TRUE(Find().openings.empty()) << top;
  }
  furniture_ = [](const Vector3d&) { return false; };
  holes_ = {Hole{2.0, 2.9, 0.9, 2.0}};
  for (const Opening& opening : Find().openings) EXPECT_FALSE(opening.doorway());
  EXPECT_EQ(Find().RoomsNotEntered(), 0);
}

// What is seen of the room behind, in plan: by the wedge that the doorway leaves.
TEST_F(OpeningsTest, WhatIsKnownBehindIsTheWedgeThatTheDoorwayLeaves) {
  const Openings found = Find();
  ASSERT_EQ(found.openings.size(), 1u);
  double wedge = 0;
  for (double x = kWall + kThick; x < 8.1; x += 0.01) {
    const double scale = (x - station_.x()) / (kWall + kThick - station_.x());
    const double near = (x - station_.x()) / (kWall - station_.x());
    const double low = 2 - std::min(0.5 * scale, 0.5 * near);
    const double high = 2 + std::min(0.4 * scale, 0.4 * near);
    wedge += 0.01 * (std::min(4.0, high) - std::max(0.0, low));
  }
  EXPECT_NEAR(found.Behind(found.openings[0]).free_area, wedge, 0.1 * wedge);
}

TEST_F(OpeningsTest, AWindowHasASillAndIsNoDoorway) {
  holes_ = {Hole{1.5, 2.5, 0.9, 2.1}};
  const Openings found = Find();
  ASSERT_EQ(found.openings.size(), 1u);
  EXPECT_FALSE(found.openings[0].doorway());
  EXPECT_NEAR(found.openings[0].sill, 0.9, kTwoVoxels);
  EXPECT_NEAR(found.openings[0].height(), 1.2, 2 * kTwoVoxels);
  EXPECT_TRUE(found.LeadsToUnknown(found.openings[0]));
  EXPECT_EQ(found.RoomsNotEntered(), 0);
}

TEST_F(OpeningsTest, ARoomIsEnteredByAStationInIt) {
  second_station_ = true;
  all_known_ = true;
  const Openings found = Find();
  ASSERT_EQ(found.openings.size(), 1u);
  EXPECT_FALSE(found.LeadsToUnknown(found.openings[0]));
  EXPECT_EQ(found.RoomsNotEntered(), 0);
}

TEST_F(OpeningsTest, ARoomThatIsKnownFromOutsideIsNotWaited) {
  all_known_ = true;
  const Openings found = Find();
  ASSERT_EQ(found.openings.size(), 1u);
  EXPECT_FALSE(found.LeadsToUnknown(found.openings[0]));
  EXPECT_EQ(found.RoomsNotEntered(), 0);
}

TEST_F(OpeningsTest, TwoDoorwaysAreTwoRoomsUntilTheSpaceBehindIsSeenToHangTogether) {
  holes_ = {Hole{0.3, 1.2, 0, 2.0}, Hole{2.8, 3.7, 0, 2.0}};
  EXPECT_EQ(Find().openings.size(), 2u);
  EXPECT_EQ(Find().RoomsNotEntered(), 2);
  // All of the room but a corner, where it goes on.
  all_known_ = true;
  unknown_from_ = 7;
  const Openings joined = Find();
  ASSERT_EQ(joined.openings.size(), 2u);
  EXPECT_EQ(joined.openings[0].behind, joined.openings[1].behind);
  EXPECT_EQ(joined.RoomsNotEntered(), 1);
}

// Between two wardrobes there is a passage as narrow as a door.
TEST_F(OpeningsTest, FurnitureMakesNoOpening) {
  holes_.clear();
  const auto row = [](const Vector3d& p) {
    return p.x() > 1.5 && p.x() < 1.7 && std::abs(p.y() - 2) > 0.35;
  };
  furniture_ = [=](const Vector3d& p) { return p.z() < 2.0 && row(p); };
  EXPECT_EQ(Find().openings.size(), 0u);
  // The same up to the ceiling is a wall, and what is in it a doorway without a lintel.
  furniture_ = row;
  ASSERT_EQ(Find().openings.size(), 1u);
  EXPECT_NEAR(Find().openings[0].height(), kCeiling, kTwoVoxels);
}

TEST_F(OpeningsTest, AGapUnderATableIsNone) {
  holes_ = {Hole{1.5, 2.4, 0, 0.7}};
  EXPECT_EQ(Find().openings.size(), 0u);
}

TEST_F(OpeningsTest, WhereAPersonGaveTheFloorThereAreNone) {
  const model::PlanningView view = test_support::BuildView(Scene());
  const FloorMap floor = FloorMap::Find(view, 0.0).value();
  EXPECT_TRUE(FindOpenings(view, floor)->openings.empty());
}

TEST_F(OpeningsTest, AreFoundInTheUpperOfTwoStoreys) {
  // The same house on a storey that is all one room.
  test_support::ClosedFormScene scene = Scene();
  const test_support::ClosedFormScene below = scene;
  scene.extent = Region(Vector3d(-0.1, -0.1, -3.1), Vector3d(8.2, 4.1, kCeiling + 0.1));
  scene.solid = [=](const Vector3d& p) {
    if (p.z() > -0.1) return below.solid(p);
    return p.x() < 0 || p.x() > 8.1 || p.y() < 0 || p.y() > 4 || p.z() < -3;
  };
  scene.known = [=](const Vector3d& p) { return p.z() < -0.1 || below.known(p); };
  scene.stations.push_back(test_support::MakeStation(Vector3d(2, 2, -1.5)));
  scene.stations.back().floor_height = -3;
  const model::PlanningView view = test_support::BuildView(scene);
  const FloorMap floor = FloorMap::Find(view, std::nullopt).value();
  ASSERT_EQ(floor.storeys().count(), 2u);
  const Openings found = FindOpenings(view, floor).value();
  ASSERT_EQ(found.openings.size(), 1u);
  EXPECT_EQ(found.openings[0].storey, 1);
  EXPECT_NEAR(found.openings[0].centre.z(), 0, kTwoVoxels);
}

// The share leaves out what is given up, and says nothing of rooms that were not entered: these are
// counted beside it.
TEST_F(OpeningsTest, CoverageCountsWhatIsUnknownBesideItsShare) {
  test_support::ClosedFormScene scene = Scene();
  scene.density = [](const Vector3d&) { return 5000; };
  const model::PlanningView view = test_support::BuildView(scene);
  const Coverage coverage = MeasureCoverage(view, {}, {}).value();
  EXPECT_EQ(coverage.openings.RoomsNotEntered(), 1);
  double all = 0;
  for (const double area : coverage.area) all += area;
  EXPECT_NEAR(coverage.estimated_coverage.value(), coverage.area_at_density / all, 1e-12);
  EXPECT_LT(coverage.estimated_coverage.value(), 1);
}

}  // namespace
}  // namespace vantage::planning
