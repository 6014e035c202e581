// Scans of which only the tilt is known: they are placed among the rooms scanned so far, or the
// answer says that the place is uncertain.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/registration/global_registration.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

constexpr double kNormalNoise = sensor::Radians(2);

double Off(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& truth) {
  return (pose.translation() - truth.translation()).norm() +
         3 * Eigen::AngleAxisd(Eigen::Matrix3d(truth.linear().transpose() * pose.linear())).angle();
}

class GlobalRegistrationInRooms : public testing::TestWithParam<unsigned> {};

TEST_P(GlobalRegistrationInRooms, FurnishedRoomIsFoundFromAnyHeading) {
  parallel::ThreadPool pool(2);
  const unsigned room = GetParam();
  std::mt19937_64 random(300 + room);
  std::uniform_real_distribution<double> unit(0, 1);
  const BoxScene scene = FurnishedRoom(room);
  const auto model = ModelOf(scene, PoseAt({-1.0, -0.6, 1.4}, 0.3), {}, kNormalNoise, 400 + room);
  const double x = 0.5 + unit(random);
  const double y = -0.5 + unit(random);
  const double heading = 2 * sensor::kPi * unit(random);
  const Eigen::Isometry3d truth =
      PoseAt({x, y, 1.3 + 0.4 * unit(random)}, heading, sensor::Radians(2) * unit(random),
             sensor::Radians(-2) * unit(random));
  const sensor::Scan scan = ScanScene(scene, truth, {}, 500 + room);
  const auto result = RegisterGlobally(*model, scan, PoseAt({-1.0, -0.6, 1.4}, 0.3), {}, pool);
  ASSERT_TRUE(result.ok()) << result.status();
  std::printf("room %u heading %.0f: off %.4f, overlap %.2f, %.2f s: %s\n", room,
              sensor::Degrees(heading), Off(result->T_world_scan, truth),
              result->verdict.overlap_share, result->seconds, result->verdict.reason.c_str());
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
  EXPECT_LT(Off(result->T_world_scan, truth), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Seeds, GlobalRegistrationInRooms, testing::Range(0U, 8U));

TEST(GlobalRegistration, RoomThatLooksTheSameTurnedAroundIsLeftOpen) {
  parallel::Serial serial;
  const auto model = ModelOf(BareRoom(), PoseAt({0.2, 0.1, 1.4}, 0), {}, kNormalNoise, 31);
  const sensor::Scan scan = ScanScene(BareRoom(), PoseAt({0.9, 0.5, 1.4}, 2.0), {}, 32);
  const auto result = RegisterGlobally(*model, scan, PoseAt({0.2, 0.1, 1.4}, 0), {}, serial);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->verdict.registered());
  EXPECT_NE(result->verdict.reason.find("another pose"), std::string::npos)
      << result->verdict.reason;
  // Turned by half the scan's surface is as far off as the room is wide, though the scanner is not.
  EXPECT_GT(result->verdict.error_bound, 5.0);
}

TEST(GlobalRegistration, RoomThatWasNotScannedIsNotFound) {
  parallel::Serial serial;
  const auto model = ModelOf(FurnishedRoom(1), PoseAt({0, 0, 1.4}, 0), {}, kNormalNoise, 33);
  BoxScene other = FurnishedRoom(9);
  other.room =
      Eigen::AlignedBox3d(Eigen::Vector3d(-1.7, -3.4, -0.4), Eigen::Vector3d(4.1, 1.6, 3.3));
  const sensor::Scan scan = ScanScene(other, PoseAt({0.5, 0, 1.4}, 0.2), {}, 34);
  const auto result = RegisterGlobally(*model, scan, PoseAt({0, 0, 1.4}, 0), {}, serial);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->verdict.registered());
  EXPECT_FALSE(result->verdict.remedy.empty());
}

TEST(GlobalRegistration, SameBytesForAnyNumberOfThreads) {
  const BoxScene scene = FurnishedRoom(5);
  const auto model = ModelOf(scene, PoseAt({-1, -0.6, 1.4}, 0), {}, kNormalNoise, 35);
  const sensor::Scan scan = ScanScene(scene, PoseAt({0.9, 0, 1.5}, 1.0), {}, 36);
  parallel::Serial serial;
  parallel::ThreadPool pool(3);
  const auto a = RegisterGlobally(*model, scan, PoseAt({0, 0, 1.4}, 0), {}, serial);
  const auto b = RegisterGlobally(*model, scan, PoseAt({0, 0, 1.4}, 0), {}, pool);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->T_world_scan.matrix(), b->T_world_scan.matrix());
  EXPECT_EQ(a->covariance, b->covariance);
  EXPECT_EQ(a->verdict.reason, b->verdict.reason);
}

// Two rooms on a site of 90 x 70 m, which has places enough for an hour if all were tried.
TEST(GlobalRegistration, ARoomFarAcrossALargeSiteIsFound) {
  parallel::ThreadPool pool(2);
  const Eigen::Vector3d away(80, 60, 0);
  const BoxScene near = FurnishedRoom(1);
  const BoxScene far = FurnishedRoom(2);
  const auto moved = [&](Eigen::Isometry3d pose) { return pose.pretranslate(away); };
  const auto partial = model::PartialModel::Create({}).value();
  const Eigen::Isometry3d first = PoseAt({-1, -0.6, 1.4}, 0.3);
  partial->Insert("near", ScanScene(near, first, {}, 1), first, pool).value();
  partial->Insert("far", ScanScene(far, first, {}, 2), moved(first), pool).value();
  const Eigen::Isometry3d truth = PoseAt({0.6, -0.3, 1.5}, 2.0);
  const sensor::Scan scan = ScanScene(far, truth, {}, 3);
  const auto result = RegisterGlobally(*partial->Publish(), scan, first, {}, pool);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
  EXPECT_LT(Off(result->T_world_scan, moved(truth)), 0.01);
}

}  // namespace
}  // namespace vantage::registration
