#include "core/planning/plan/required_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/planning/plan/planning_config.h"

namespace vantage::planning {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Outline = std::vector<Vector2d>;

// How often an outline goes around a place: by the angles under which its sides are seen.
bool GoesAround(const Outline& outline, const Vector2d& p) {
  double angle = 0;
  for (size_t i = 0; i < outline.size(); ++i) {
    const Vector2d a = outline[i] - p;
    const Vector2d b = outline[(i + 1) % outline.size()] - p;
    angle += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return std::abs(angle) > 3;
}

// A star around a place: no two of its sides cross, and few of them turn the same way.
Outline Star(std::mt19937& random, const Vector2d& centre) {
  std::uniform_real_distribution<double> radius(0.5, 3);
  const int corners = 3 + static_cast<int>(random() % 9);
  Outline outline;
  for (int i = 0; i < corners; ++i) {
    const double angle = 6.283185307 * (i + 0.1) / corners;
    outline.push_back(centre + radius(random) * Vector2d(std::cos(angle), std::sin(angle)));
  }
  if (random() % 2 == 0) std::reverse(outline.begin(), outline.end());
  return outline;
}

RequiredRegion RegionOf(Outline outline) {
  RequiredRegion region;
  region.outline = std::move(outline);
  return region;
}

const Outline kSquare = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
const Outline kCorner = {{2, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 2}, {2, 2}};  // around the square

TEST(RequiredRegionTest, ContainsWhatItsOutlineGoesAround) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-4, 4);
  int inside = 0;
  for (int k = 0; k < 50; ++k) {
    const RequiredRegion region = RegionOf(Star(random, {place(random) / 4, 0}));
    EXPECT_EQ(OutlineFault(region.outline), "");
    for (int i = 0; i < 500; ++i) {
      const Vector2d p(place(random), place(random));
      const bool expected = GoesAround(region.outline, p);
      ASSERT_EQ(region.Contains({p.x(), p.y(), 0}), expected) << p.transpose();
      inside += expected ? 1 : 0;
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(RequiredRegionTest, WhatTouchesSharesNoPointAndLeavesNoneOut) {
  RequiredRegion below = RegionOf(kSquare);
  below.max_z = 2.5;
  RequiredRegion above = RegionOf(kSquare);
  above.min_z = 2.5;
  RequiredRegion beside = RegionOf(kCorner);
  std::reverse(beside.outline.begin(), beside.outline.end());
  for (double y = 0.25; y < 4; y += 0.25) {
    for (double x = 0.25; x < 4; x += 0.25) {
      for (const double z : {-100.0, 2.5, 100.0}) {
        const Vector3d p(x, y, z);
        EXPECT_EQ(int{below.Contains(p)} + int{above.Contains(p)} + int{beside.Contains(p)}, 1)
            << p.transpose();
      }
    }
  }
  // Along a side that is not level, too.
  const RequiredRegion left = RegionOf({{0, 0}, {0.7, 3.1}, {-3, 1}});
  const RequiredRegion right = RegionOf({{0, 0}, {4, 1}, {0.7, 3.1}});
  for (int i = 1; i < 1000; ++i) {
    const Vector2d p = i / 1000.0 * Vector2d(0.7, 3.1);
    EXPECT_NE(left.Contains({p.x(), p.y(), 0}), right.Contains({p.x(), p.y(), 0})) << i;
  }
}

TEST(RequiredRegionTest, TheCommonAreaIsThatOfAFineGrid) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-2, 2);
  constexpr double kGrid = 0.05;
  int overlap = 0;
  for (int k = 0; k < 30; ++k) {
    const Outline a = Star(random, {place(random), place(random)});
    const Outline b = Star(random, {place(random), place(random)});
    double counted = 0;
    for (double y = -5; y < 5; y += kGrid) {
      for (double x = -5; x < 5; x += kGrid) {
        if (GoesAround(a, {x, y}) && GoesAround(b, {x, y})) counted += kGrid * kGrid;
      }
    }
    EXPECT_NEAR(CommonArea(a, b), counted, 0.15) << k;
    overlap += counted > 0.5 ? 1 : 0;
  }
  EXPECT_GT(overlap, 10);
  EXPECT_NEAR(CommonArea(kSquare, kSquare), 4, 1e-12);
  EXPECT_NEAR(CommonArea(kSquare, kCorner), 0, 1e-12);
}

TEST(RequiredRegionTest, RegionsThatTouchDoNotOverlap) {
  RequiredRegion a = RegionOf(kSquare);
  EXPECT_TRUE(Overlap(a, a));
  EXPECT_FALSE(Overlap(a, RegionOf(kCorner)));
  // Rounded to a tenth of a millimetre, and by more than that.
  EXPECT_FALSE(Overlap(a, RegionOf({{1.9999, 0}, {4, 0}, {4, 2}, {1.9999, 2}})));
  EXPECT_TRUE(Overlap(a, RegionOf({{1.99, 0}, {4, 0}, {4, 2}, {1.99, 2}})));
  RequiredRegion above = a;
  a.max_z = 3;
  above.min_z = 3;
  EXPECT_FALSE(Overlap(a, above));
  above.min_z = 2.9;
  EXPECT_TRUE(Overlap(a, above));
}

TEST(RequiredRegionTest, FaultyOutlinesAreTold) {
  const double nan = std::nan("");
  for (const Outline& outline : {Outline{},
                                 {{0, 0}, {1, 1}},
                                 {{0, 0}, {1, nan}, {1, 0}},
                                 {{0, 0}, {2, 0}, {2, 0}, {0, 2}},
                                 {{0, 0}, {2, 2}, {2, 0}, {0, 2}},             // a bow tie
                                 {{0, 0}, {4, 0}, {2, 0}, {2, 2}},             // turns back
                                 {{0, 0}, {4, 0}, {4, 2}, {2, 0}, {0, 2}},     // touches itself
                                 {{0, 0}, {1, 0}, {2, 0}},                     // a line
                                 {{0, 0}, {10, 0}, {10, 1e-5}, {0, 1e-5}}}) {  // hardly more
    EXPECT_NE(OutlineFault(outline), "") << outline.size();
  }
  EXPECT_EQ(OutlineFault(kSquare), "");
  EXPECT_EQ(OutlineFault(kCorner), "");
  EXPECT_EQ(OutlineFault({{0, 0}, {1, 0}, {2, 0}, {1, 1}}), "");  // a corner on a straight side
}

TEST(RequiredRegionTest, TheConfigurationNamesWhatIsImpossible) {
  PlanningConfig config;
  config.regions = {RegionOf(kSquare), RegionOf(kCorner)};
  EXPECT_TRUE(config.Validate(sensor::ScannerModel()).ok());
  const auto message = [&] {
    return std::string(config.Validate(sensor::ScannerModel()).message());
  };
  config.regions[1].outline = kSquare;
  EXPECT_NE(message().find("regions[1] overlaps regions[0]"), std::string::npos) << message();
  config.regions[1].outline = {{0, 0}};
  EXPECT_NE(message().find("regions[1] has 1 corners"), std::string::npos) << message();
  config.regions = {RegionOf(kSquare)};
  config.regions[0].density = 1e9;
  EXPECT_NE(message().find("density of regions[0]"), std::string::npos) << message();
  config.regions[0].density = 100;
  config.regions[0].weight = -1;
  EXPECT_NE(message().find("weight of regions[0]"), std::string::npos) << message();
  config.regions[0].weight = 1;
  config.regions[0].min_z = config.regions[0].max_z = 1;
  EXPECT_NE(message().find("regions[0] must have min_z"), std::string::npos) << message();
  config.regions[0].min_z = std::nan("");
  EXPECT_FALSE(config.Validate(sensor::ScannerModel()).ok());
}

TEST(RequiredRegionTest, RequirementsAreThoseOfTheRegionOfAPlace) {
  PlanningConfig config;
  config.required_density = 1000;
  config.regions = {RegionOf(kSquare), RegionOf(kCorner)};
  config.regions[0].density = 4000;
  config.regions[0].weight = 2;
  config.regions[1].weight = 0;
  const auto square = config.RequiredAt({1, 1, 0});
  ASSERT_TRUE(square.has_value());
  EXPECT_EQ(square->region, 0u);
  EXPECT_EQ(square->density, 4000);
  EXPECT_EQ(square->worth, 0.5);  // an area counts twice, of four times as many samples
  EXPECT_FALSE(config.RequiredAt({3, 3, 0}).has_value());
  const auto elsewhere = config.RequiredAt({9, 9, 0});
  ASSERT_TRUE(elsewhere.has_value());
  EXPECT_FALSE(elsewhere->region.has_value());
  EXPECT_EQ(elsewhere->density, 1000);
  EXPECT_EQ(elsewhere->worth, 1);
  config.region_of_interest = Region(Vector3d(0, 0, 0), Vector3d(1.5, 1.5, 1));
  EXPECT_TRUE(config.RequiredAt({1, 1, 0.5}).has_value());
  EXPECT_FALSE(config.RequiredAt({1.75, 1.75, 0.5}).has_value());
}

TEST(NamedStoreysTest, AreThoseWhoseFloorIsNear) {
  const std::vector<NamedStorey> named = {{"ground floor", 0}, {"attic", 2.8}};
  EXPECT_EQ(NameOfStorey(0.03, named), "ground floor");
  EXPECT_EQ(NameOfStorey(2.6, named), "attic");
  EXPECT_EQ(NameOfStorey(1.4, named), "");
  EXPECT_EQ(NameOfStorey(-2.7, named), "");
  EXPECT_EQ((Storey{1, 2.8, "attic"}.Words()), "storey 1 (attic)");
  EXPECT_EQ((Storey{1, 2.8, ""}.Words()), "storey 1");
}

}  // namespace
}  // namespace vantage::planning
