// What scans say of a suspected reflector, and when that is enough.
#include "core/model/reflections/suspected_reflector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "core/parallel/parallel.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::model {
namespace {

// `count` returns of which each got the same answer.
Testimony Says(size_t count, int bits) {
  return {std::vector<uint8_t>(count, static_cast<uint8_t>(bits)), false};
}
bool Told(const Testimony& own, const std::vector<Testimony>& others) {
  std::vector<const Testimony*> pointers;
  pointers.reserve(others.size());
  for (const Testimony& other : others) pointers.push_back(&other);
  return IsReflector(own, pointers);
}

TEST(IsReflectorTest, OtherScansTellWhatOneSuspects) {
  EXPECT_TRUE(Told(Says(100, 0), {Says(100, Testimony::kAgrees)}));
  EXPECT_TRUE(Told(Says(100, Testimony::kAgrees), {Says(100, Testimony::kAgrees)}));
}

TEST(IsReflectorTest, OneScanIsNotEnough) {
  EXPECT_FALSE(Told(Says(100, Testimony::kAgrees), {}));
  EXPECT_FALSE(Told(Says(100, Testimony::kAgrees), {Says(100, 0), Testimony()}));
}

TEST(IsReflectorTest, MuchHasToAgreeAndHardlyAnythingToContradict) {
  Testimony other = Says(100, Testimony::kAgrees);
  for (size_t i = 0; i < 8; ++i) other.of_returns[i] = Testimony::kContradicts;
  EXPECT_TRUE(Told(Says(100, 0), {other}));
  other.of_returns[8] = Testimony::kContradicts;
  EXPECT_FALSE(Told(Says(100, 0), {other}));
  // What nobody measured says neither.
  Testimony third = Says(99, Testimony::kAgrees);
  for (size_t i = 0; i < 66; ++i) third.of_returns[i] = 0;
  EXPECT_TRUE(Told(Says(99, 0), {third}));
  third.of_returns[66] = 0;
  EXPECT_FALSE(Told(Says(99, 0), {third}));
}

TEST(IsReflectorTest, WhatAgreesWithAnyPlaneTellsNothing) {
  const int floor = Testimony::kAgrees | Testimony::kAgreesFarther | Testimony::kAgreesNearer;
  EXPECT_FALSE(Told(Says(100, floor), {Says(100, floor)}));
  // Nor when one scan says the one half of it and one the other.
  EXPECT_FALSE(Told(Says(100, Testimony::kAgrees | Testimony::kAgreesFarther),
                    {Says(100, Testimony::kAgrees | Testimony::kAgreesNearer)}));
}

TEST(IsReflectorTest, WhatOneScanMeasuredAndAnotherSawEmptyWasMoved) {
  EXPECT_FALSE(
      Told(Says(100, 0), {Says(100, Testimony::kAgrees), Says(100, Testimony::kContradicts)}));
}

TEST(IsReflectorTest, WhoSeesThroughFromBehindRefutes) {
  std::vector<Testimony> others = {Says(100, Testimony::kAgrees), Testimony()};
  EXPECT_TRUE(Told(Says(100, Testimony::kAgrees), others));
  others[1].sees_through = true;
  EXPECT_FALSE(Told(Says(100, Testimony::kAgrees), others));
}

// Two rooms that are mirror images of each other, with a doorway between them: by what a scan from
// one of them shows, a mirror may hang there.
class TestifyTest : public testing::Test {
 protected:
  TestifyTest() {
    scene_.air = {{Eigen::Vector3d(-3, -2, 0), Eigen::Vector3d(-0.06, 2, 2.5)},
                  {Eigen::Vector3d(0.06, -2, 0), Eigen::Vector3d(3, 2, 2.5)},
                  {Eigen::Vector3d(-0.1, -0.5, 0), Eigen::Vector3d(0.1, 0.5, 2)}};
  }

  RangeSurface ScanFrom(const Eigen::Vector3d& at) {
    const sensor::Scan scan = ScanScene(scene_, PoseAt(at, 0), {.noise = 0.003});
    return {scan.image, scan.scanner, 0.14, serial_};
  }
  // In the middle of the doorway, as the scan sees it, and all that it sees through the doorway.
  SuspectedReflector Doorway(const RangeSurface& surface) {
    const ReturnTest returns(surface);
    const ReflectingPlane plane{-Eigen::Vector3d::UnitX(), -kFrom.x()};
    std::vector<ScanCell> cells;
    std::vector<Eigen::Vector3d> crossings;
    for (int c = 0; c < surface.columns(); ++c) {
      for (int r = 0; r < surface.rows(); ++r) {
        if (!surface.Returned(c, r) || !returns.WellBehind(plane, c, r)) continue;
        cells.push_back({c, r});
        crossings.push_back(plane.Crossing(surface.Direction(c, r)));
      }
    }
    return {plane, cells, Aperture(plane.normal, plane.distance, crossings)};
  }
  static Eigen::Isometry3d From(const Eigen::Vector3d& witness) {
    return PoseAt(witness, 0).inverse(Eigen::Isometry) * PoseAt(kFrom, 0);
  }

  static inline const Eigen::Vector3d kFrom = Eigen::Vector3d(-2, 0.3, 1.5);
  parallel::Serial serial_;
  ClosedFormScene scene_;
};

TEST_F(TestifyTest, AScanOfTheSameRoomAgrees) {
  const RangeSurface surface = ScanFrom(kFrom);
  const SuspectedReflector suspect = Doorway(surface);
  ASSERT_GT(suspect.asked.size(), 500u);
  const Eigen::Vector3d beside(-1.5, -1.2, 1.4);
  const Testimony said = Testify(suspect, suspect.plane, surface, ScanFrom(beside), From(beside));
  ASSERT_EQ(said.of_returns.size(), suspect.asked.size());
  size_t agree = 0;
  size_t contradict = 0;
  for (const uint8_t bits : said.of_returns) {
    agree += (bits & Testimony::kAgrees) != 0 ? 1 : 0;
    contradict += (bits & Testimony::kContradicts) != 0 ? 1 : 0;
  }
  EXPECT_GT(10 * agree, 9 * said.of_returns.size());
  EXPECT_EQ(contradict, 0u);
  EXPECT_FALSE(said.sees_through) << "it stands before the doorway";
}

TEST_F(TestifyTest, AScanOfTheRoomBehindSeesThrough) {
  const RangeSurface surface = ScanFrom(kFrom);
  const SuspectedReflector suspect = Doorway(surface);
  const Eigen::Vector3d behind(1.5, 0.2, 1.4);
  EXPECT_TRUE(
      Testify(suspect, suspect.plane, surface, ScanFrom(behind), From(behind)).sees_through);
  // Nobody sees through a wall.
  scene_.air.pop_back();
  EXPECT_FALSE(
      Testify(suspect, suspect.plane, surface, ScanFrom(behind), From(behind)).sees_through);
}

// A plane that hangs askew by a degree and a half shows most of the room behind it half a foot off.
TEST_F(TestifyTest, AWitnessStraightensThePlane) {
  const RangeSurface surface = ScanFrom(kFrom);
  SuspectedReflector suspect = Doorway(surface);
  const Eigen::Vector3d beside(-1.5, -1.2, 1.4);
  const RangeSurface witness = ScanFrom(beside);
  const ReflectingPlane straight = suspect.plane;
  EXPECT_FALSE(FitByWitness(suspect, surface, witness, From(beside))) << "nothing to better";
  const Eigen::Vector3d through = -straight.distance * straight.normal;
  suspect.plane.normal =
      Eigen::AngleAxisd(sensor::Radians(1.5), Eigen::Vector3d::UnitZ()) * straight.normal;
  suspect.plane.distance = 0.02 - suspect.plane.normal.dot(through);
  const std::optional<WitnessFit> fit = FitByWitness(suspect, surface, witness, From(beside));
  ASSERT_TRUE(fit.has_value());
  EXPECT_LT(std::acos(fit->plane.normal.dot(straight.normal)), sensor::Radians(0.5));
  EXPECT_NEAR(fit->plane.Above(through), 0, 0.02);
  // Who is in another house says nothing of it.
  const Eigen::Vector3d away(-1.5, -41.2, 1.4);
  EXPECT_FALSE(FitByWitness(suspect, surface, witness, From(away)));
  // And no mirror hangs behind the face of its wall.
  suspect.wall = through + 0.05 * straight.normal;
  EXPECT_FALSE(FitByWitness(suspect, surface, witness, From(beside)));
}

}  // namespace
}  // namespace vantage::model
