#include "core/planning/openings/wall_distance.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/simulation/random_sequence.h"

namespace vantage::planning {
namespace {

TEST(WallDistanceTest, IsThatOfBruteForce) {
  for (const double share : {0.002, 0.05, 0.5}) {
    const Eigen::Vector2i size(37, 23);
    std::vector<uint8_t> solid(static_cast<size_t>(size.prod()));
    simulation::RandomSequence random(7);
    for (uint8_t& cell : solid) cell = random.Chance(share) ? 1 : 0;
    solid[100] = 1;
    const std::vector<int32_t> squared = SquaredWallDistance(size, solid);
    for (int at = 0; at < size.prod(); ++at) {
      int32_t least = kNoWall;
      for (int to = 0; to < size.prod(); ++to) {
        if (solid[static_cast<size_t>(to)] == 0) continue;
        const int dx = to % size.x() - at % size.x();
        const int dy = to / size.x() - at / size.x();
        least = std::min(least, dx * dx + dy * dy);
      }
      ASSERT_EQ(squared[static_cast<size_t>(at)], least) << share << " " << at;
    }
  }
}

TEST(WallDistanceTest, WithoutWallsThereIsNone) {
  const std::vector<int32_t> squared = SquaredWallDistance({4, 3}, std::vector<uint8_t>(12, 0));
  EXPECT_EQ(std::count(squared.begin(), squared.end(), kNoWall), 12);
}

}  // namespace
}  // namespace vantage::planning
