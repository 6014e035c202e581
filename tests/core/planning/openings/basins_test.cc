// Basins of plans drawn as text: '#' is wall, '.' is free, ' ' unknown.
#include "core/planning/openings/basins.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/planning/openings/wall_distance.h"

namespace vantage::planning {
namespace {

struct Drawing {
  explicit Drawing(const std::vector<std::string>& rows)
      : size(static_cast<int>(rows[0].size()), static_cast<int>(rows.size())) {
    std::vector<uint8_t> solid;
    for (const std::string& row : rows) {
      for (const char c : row) {
        solid.push_back(c == '#');
        free.push_back(c == '.');
      }
    }
    squared = SquaredWallDistance(size, solid);
    basins = FindBasins(size, free, squared).value();
  }
  int At(int x, int y) const { return basins.of[static_cast<size_t>(x + size.x() * y)]; }

  Eigen::Vector2i size;
  std::vector<uint8_t> free;
  std::vector<int32_t> squared;
  Basins basins;
};

TEST(BasinsTest, TwoRoomsMeetInTheMiddleOfTheirDoorway) {
  const Drawing plan({"#################", "#.......#.......#", "#.......#.......#",
                      "#...............#", "#...............#", "#...............#",
                      "#.......#.......#", "#.......#.......#", "#################"});
  ASSERT_EQ(plan.basins.count, 2);
  ASSERT_EQ(plan.basins.narrows.size(), 1u);
  const NarrowPlace& door = plan.basins.narrows[0];
  EXPECT_NEAR(static_cast<int>(door.cell) % 17, 8, 1);
  EXPECT_EQ(door.cell / 17, 4u);
  EXPECT_NE(plan.At(2, 4), plan.At(14, 4));
  EXPECT_EQ(plan.At(2, 4), plan.At(1, 1));
}

TEST(BasinsTest, ARoomThatNarrowsALittleIsOne) {
  std::vector<std::string> rows(13, "#...........................#");
  rows.front() = rows.back() = std::string(29, '#');
  rows[1][14] = rows[11][14] = '#';
  const Drawing plan(rows);
  EXPECT_EQ(plan.basins.count, 1);
  EXPECT_TRUE(plan.basins.narrows.empty());
}

TEST(BasinsTest, TwoDoorwaysBetweenTheSameRoomsAreTwoNarrowPlaces) {
  const Drawing plan({"#####################", "#.........#.........#", "#.........#.........#",
                      "#...................#", "#...................#", "#.........#.........#",
                      "#.........#.........#", "#.........#.........#", "#.........#.........#",
                      "#...................#", "#...................#", "#.........#.........#",
                      "#.........#.........#", "#####################"});
  ASSERT_EQ(plan.basins.count, 2);
  EXPECT_EQ(plan.basins.narrows.size(), 2u);
}

// Unknown space joins nothing, however wide it is.
TEST(BasinsTest, UnknownSpaceIsNoWayFromRoomToRoom) {
  const Drawing plan({"#################", "#......   ......#", "#......   ......#",
                      "#......   ......#", "#......   ......#", "#################"});
  ASSERT_EQ(plan.basins.count, 2);
  EXPECT_TRUE(plan.basins.narrows.empty());
  EXPECT_EQ(plan.At(8, 2), -1);
}

}  // namespace
}  // namespace vantage::planning
