#include "core/site_prior/wall_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/simulation/random_sequence.h"

namespace vantage::site_prior {
namespace {

void AddQuad(PriorMesh& mesh, const Eigen::Vector3f& a, const Eigen::Vector3f& b,
             const Eigen::Vector3f& c, const Eigen::Vector3f& d) {
  const auto at = static_cast<uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.triangles.push_back({at, at + 1, at + 2});
  mesh.triangles.push_back({at, at + 2, at + 3});
}

// Walls, floor and ceiling.
void AddBox(PriorMesh& mesh, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const auto at = [&](int i) {
    return Eigen::Vector3f((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                           (i & 4) != 0 ? high.z() : low.z());
  };
  AddQuad(mesh, at(0), at(1), at(3), at(2));
  AddQuad(mesh, at(4), at(5), at(7), at(6));
  AddQuad(mesh, at(0), at(1), at(5), at(4));
  AddQuad(mesh, at(2), at(3), at(7), at(6));
  AddQuad(mesh, at(0), at(2), at(6), at(4));
  AddQuad(mesh, at(1), at(3), at(7), at(5));
}

double LengthOf(const WallLine& line) {
  double length = 0;
  for (size_t i = 1; i < line.corners.size(); ++i) {
    length += static_cast<double>((line.corners[i] - line.corners[i - 1]).norm());
  }
  return length;
}

TEST(WallLines, AroundARoomAndNotAroundATable) {
  PriorMesh mesh;
  AddBox(mesh, {0, 0, 0}, {6, 4, 2.6F});
  AddBox(mesh, {2, 1, 0.7F}, {3, 2, 0.75F});
  const std::vector<WallLine> lines = WallLinesOf(mesh, 1);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].corners.front(), lines[0].corners.back());
  EXPECT_NEAR(LengthOf(lines[0]), 20, 1e-3);
  EXPECT_NEAR(lines[0].floor, 0, 0.1);
  // Four corners, the one where it begins twice, and that one need be none of the room's.
  EXPECT_LE(lines[0].corners.size(), 6U);
  for (const Eigen::Vector2f& corner : lines[0].corners) {
    const bool on = std::abs(corner.x()) < 1e-3F || std::abs(corner.x() - 6) < 1e-3F ||
                    std::abs(corner.y()) < 1e-3F || std::abs(corner.y() - 4) < 1e-3F;
    EXPECT_TRUE(on) << corner.transpose();
  }
}

// In a file where the building is half as large the cut lies half as high.
TEST(WallLines, HeightsAreThoseOfTheSite) {
  PriorMesh mesh;
  AddBox(mesh, {0, 0, 0}, {3, 2, 1.3F});
  AddBox(mesh, {1, 1, 0}, {1.5F, 1.2F, 0.8F});  // to 1.6 m at the site
  EXPECT_EQ(WallLinesOf(mesh, 2).size(), 2U);
  AddBox(mesh, {2, 1, 0}, {2.5F, 1.2F, 0.6F});  // to 1.2 m
  EXPECT_EQ(WallLinesOf(mesh, 2).size(), 2U);
}

TEST(WallLines, OfEachStoreyByItsFloor) {
  PriorMesh mesh;
  AddBox(mesh, {0, 0, 0}, {6, 4, 2.5F});
  AddBox(mesh, {0, 0, 2.8F}, {5, 4, 5.3F});
  AddBox(mesh, {0, 0, 5.6F}, {4, 4, 8.1F});
  const std::vector<WallLine> lines = WallLinesOf(mesh, 1);
  ASSERT_EQ(lines.size(), 3U);
  for (size_t storey = 0; storey < 3; ++storey) {
    EXPECT_NEAR(lines[storey].floor, 2.8 * static_cast<double>(storey), 0.1);
    EXPECT_NEAR(LengthOf(lines[storey]), 20 - 2 * static_cast<double>(storey), 1e-3);
  }
}

// What would be more than an answer may have is drawn more coarsely, then the longest of it.
TEST(WallLines, NoMoreThanMayBe) {
  PriorMesh mesh;
  AddBox(mesh, {0, 0, 0}, {100, 100, 3});
  simulation::RandomSequence random(1);
  for (int i = 0; i < 3000; ++i) {
    const auto x = static_cast<float>(random.Between(1, 98));
    const auto y = static_cast<float>(random.Between(1, 98));
    AddBox(mesh, {x, y, 0}, {x + 0.3F, y + 0.3F, 3});
  }
  const std::vector<WallLine> lines = WallLinesOf(mesh, 1);
  size_t corners = 0;
  double longest = 0;
  for (const WallLine& line : lines) {
    corners += line.corners.size();
    longest = std::max(longest, LengthOf(line));
  }
  EXPECT_LE(corners, kMostWallCorners);
  EXPECT_GT(corners, kMostWallCorners / 2);
  EXPECT_NEAR(longest, 400, 0.1) << "the outer wall is among them";
}

TEST(WallLines, OfNoiseAndOfNothing) {
  EXPECT_TRUE(WallLinesOf({}, 1).empty());
  PriorMesh flat;
  AddQuad(flat, {0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0});
  EXPECT_TRUE(WallLinesOf(flat, 1).empty());
  PriorMesh noise;
  simulation::RandomSequence random(2);
  for (int i = 0; i < 300'000; ++i) {
    const auto at = static_cast<uint32_t>(noise.vertices.size());
    for (int k = 0; k < 3; ++k) {
      noise.vertices.emplace_back(static_cast<float>(random.Between(0, 50)),
                                  static_cast<float>(random.Between(0, 50)),
                                  static_cast<float>(random.Between(0, 20)));
    }
    noise.triangles.push_back({at, at + 1, at + 2});
  }
  size_t corners = 0;
  for (const WallLine& line : WallLinesOf(noise, 1)) corners += line.corners.size();
  EXPECT_LE(corners, kMostWallCorners);
}

}  // namespace
}  // namespace vantage::site_prior
