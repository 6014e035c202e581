#include "core/registration/sightings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

const Eigen::Vector3d kPlace(3, 1, 2);  // m, world frame

Sighting Seen(const std::string& name, const Eigen::Vector3d& place,
              const Eigen::Isometry3d& pose) {
  Sighting sighting;
  sighting.name = name;
  sighting.in_scan = pose.inverse() * place;
  return sighting;
}

TEST(SightingsTest, TheScanWithTheBestKnownPoseSaysWhereATargetIs) {
  const Eigen::Isometry3d pose = PoseAt({1, 1, 1.5}, 0.4);
  const Eigen::Vector3d off(0.01, 0, 0);
  const SightingsOfScan vague{pose, 0.0098, {Seen("T", kPlace + off, pose)}};
  const SightingsOfScan sure{pose, 0.00196, {Seen("T", kPlace, pose)}};
  const Sighting sighted = Seen("T", kPlace, PoseAt({2, 2, 1.5}, 1));
  for (const auto& before : {std::vector{vague, sure}, std::vector{sure, vague}}) {
    const std::vector<TargetTie> ties = TiesOf({&sighted, 1}, before);
    ASSERT_EQ(ties.size(), 1u);
    EXPECT_LT((ties[0].in_world - kPlace).norm(), 1e-12);
    // The sighting's own 2 mm, and the pose's bound of 1.96 mm at 95 %.
    EXPECT_NEAR(ties[0].sigma, std::hypot(0.002, 0.001), 1e-12);
  }
}

TEST(SightingsTest, AControlNetworkIsBelievedBeforeScans) {
  const Eigen::Isometry3d pose = PoseAt({1, 1, 1.5}, 0.4);
  const SightingsOfScan before{pose, 0, {Seen("T", kPlace, pose)}};
  Sighting sighted = Seen("T", kPlace, pose);
  sighted.in_world = Eigen::Vector3d(3.02, 1, 2);
  sighted.sigma = 0.005;
  const std::vector<TargetTie> ties = TiesOf({&sighted, 1}, {&before, 1});
  ASSERT_EQ(ties.size(), 1u);
  EXPECT_EQ(ties[0].in_world, *sighted.in_world);
  EXPECT_EQ(ties[0].sigma, 0.005);
}

TEST(SightingsTest, TiesStayWithinTheirLimitAndUnknownTargetsAreNone) {
  const Eigen::Isometry3d pose = PoseAt({1, 1, 1.5}, 0.4);
  const SightingsOfScan before{pose, 5, {Seen("T", kPlace, pose)}};
  const std::vector<Sighting> sighted = {Seen("new", kPlace, pose), Seen("T", kPlace, pose)};
  const std::vector<TargetTie> ties = TiesOf(sighted, {&before, 1});
  ASSERT_EQ(ties.size(), 1u);
  EXPECT_EQ(ties[0].name, "T");
  EXPECT_EQ(ties[0].sigma, 1);
  EXPECT_TRUE(ValidateTargets(ties).ok());
}

TEST(SightingsTest, AllThatAreKnownAreListedByName) {
  const Eigen::Isometry3d pose = PoseAt({1, 1, 1.5}, 0.4);
  Sighting surveyed = Seen("A", kPlace, pose);
  surveyed.in_world = kPlace + Eigen::Vector3d(0.02, 0, 0);
  const std::vector<SightingsOfScan> before = {
      {pose, 0.0098, {Seen("T", kPlace, pose), surveyed}},
      {pose, 0.00196, {Seen("T", kPlace, pose), Seen("A", kPlace, pose)}}};
  const std::vector<KnownTarget> known = KnownTargetsOf(before);
  ASSERT_EQ(known.size(), 2u);
  EXPECT_EQ(known[0].name, "A");
  EXPECT_EQ(known[0].in_world, *surveyed.in_world);
  EXPECT_EQ(known[0].sigma, TargetTie().sigma);
  EXPECT_EQ(known[1].name, "T");
  EXPECT_LT((known[1].in_world - kPlace).norm(), 1e-12);
  EXPECT_NEAR(known[1].sigma, std::hypot(0.002, 0.001), 1e-12);
}

TEST(SightingsTest, ATargetFarFromItsPlaceRefutesAPose) {
  const Eigen::Isometry3d pose = PoseAt({1, 1, 1.5}, 0.4);
  TargetTie tie;
  tie.in_world = kPlace;
  tie.in_scan = pose.inverse() * kPlace;
  Eigen::Isometry3d other = pose;
  EXPECT_FALSE(Refute({&tie, 1}, pose));
  other.translation().x() += 4.9 * tie.sigma;
  EXPECT_FALSE(Refute({&tie, 1}, other));
  other.translation().x() += 0.2 * tie.sigma;
  EXPECT_TRUE(Refute({&tie, 1}, other));
  EXPECT_FALSE(Refute({}, other));
}

}  // namespace
}  // namespace vantage::registration
