#include "core/registration/graph/max_clique.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace vantage::registration {
namespace {

std::vector<std::vector<bool>> RandomNeighbours(size_t count, double share,
                                                std::mt19937_64& random) {
  std::bernoulli_distribution draw(share);
  std::vector<std::vector<bool>> neighbours(count, std::vector<bool>(count, false));
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = 0; j < i; ++j) neighbours[i][j] = neighbours[j][i] = draw(random);
  }
  return neighbours;
}

bool IsClique(const std::vector<size_t>& vertices,
              const std::vector<std::vector<bool>>& neighbours) {
  for (const size_t v : vertices) {
    for (const size_t w : vertices) {
      if (v != w && !neighbours[v][w]) return false;
    }
  }
  return true;
}

TEST(MaxCliqueTest, AsLargeAsByBruteForce) {
  std::mt19937_64 random(17);
  for (int round = 0; round < 60; ++round) {
    const size_t count = 1 + static_cast<size_t>(round % 13);
    const auto neighbours = RandomNeighbours(count, 0.2 + 0.1 * (round % 8), random);
    size_t largest = 0;
    for (uint32_t set = 0; set < (1U << count); ++set) {
      std::vector<size_t> vertices;
      for (size_t v = 0; v < count; ++v) {
        if ((set >> v) & 1U) vertices.push_back(v);
      }
      if (vertices.size() > largest && IsClique(vertices, neighbours)) largest = vertices.size();
    }
    const Clique clique = LargestClique(neighbours, 1'000'000);
    EXPECT_TRUE(clique.exact);
    EXPECT_EQ(clique.vertices.size(), largest);
    EXPECT_EQ(clique.bound, largest);
    EXPECT_TRUE(IsClique(clique.vertices, neighbours));
  }
  EXPECT_TRUE(LargestClique({}, 10).vertices.empty());
}

// Where the time runs out there is still a set, and a bound that holds.
TEST(MaxCliqueTest, EndsInTime) {
  std::mt19937_64 random(23);
  const auto neighbours = RandomNeighbours(150, 0.8, random);
  const Clique soon = LargestClique(neighbours, 20'000);
  const Clique later = LargestClique(neighbours, 3'000'000);
  EXPECT_FALSE(soon.exact);
  EXPECT_TRUE(IsClique(soon.vertices, neighbours));
  EXPECT_GE(later.vertices.size(), soon.vertices.size());
  EXPECT_GE(soon.vertices.size(), 10u);
  EXPECT_GE(soon.bound, later.vertices.size());
}

}  // namespace
}  // namespace vantage::registration
