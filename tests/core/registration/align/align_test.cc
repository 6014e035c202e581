// Alignment and its verdict in closed-form rooms, where the true pose is known. Models are made of
// scans, as a server makes them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/parallel/thread_pool.h"
#include "core/registration/align/align.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

struct PoseError {
  double metres;
  double degrees;
};
PoseError ErrorOf(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& truth) {
  const Eigen::Isometry3d e = truth.inverse() * pose;
  return {e.translation().norm(), sensor::Degrees(Eigen::AngleAxisd(e.linear()).angle())};
}

class FurnishedRooms : public testing::TestWithParam<unsigned> {};

TEST_P(FurnishedRooms, FromPriorsUpTo30CentimetresAnd10Degrees) {
  parallel::ThreadPool pool(2);
  const unsigned room = GetParam();
  std::mt19937_64 random(101 + room);
  std::uniform_real_distribution<double> unit(0, 1);
  const BoxScene scene = FurnishedRoom(room);
  const auto model = ModelFromScan(scene, PoseAt({-1.0, -0.6, 1.4}, 0.3), {}, 1000 + room);
  int accurate = 0;
  int registered = 0;
  int wrongly_registered = 0;
  int bound_holds = 0;
  constexpr int kTrials = test_support::Runs(20);
  for (unsigned t = 0; t < kTrials; ++t) {
    const Eigen::Isometry3d truth =
        PoseAt({0.8 + 0.5 * unit(random), -0.3 + 0.6 * unit(random), 1.3 + 0.3 * unit(random)},
               2 * sensor::kPi * unit(random), sensor::Radians(2) * unit(random),
               sensor::Radians(2) * unit(random));
    const sensor::Scan scan = ScanScene(scene, truth, {}, 2000 + 100 * room + t);
    sensor::PosePrior prior;
    prior.T_world_scan =
        Disturbed(truth, 0.3 * unit(random), sensor::Radians(10) * unit(random), random);
    const auto result = Register(*model, scan, prior, {}, pool);
    ASSERT_TRUE(result.ok()) << result.status();
    const PoseError error = ErrorOf(result->T_world_scan, truth);
    // Four times what is left over of these rooms at most.
    const bool right = error.metres <= 0.0005 && error.degrees <= 0.01;
    // The largest displacement of the room's corners is what the bound is about.
    double moved = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d x =
          scene.room.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
      moved = std::max(moved, (result->T_world_scan * (truth.inverse() * x) - x).norm());
    }
    accurate += right ? 1 : 0;
    registered += result->verdict.registered() ? 1 : 0;
    bound_holds += moved <= result->verdict.judged_bound ? 1 : 0;
    wrongly_registered += result->verdict.registered() && moved > 0.010 ? 1 : 0;
    std::printf("room %u prior %u: %.2f mm, %.3f degrees, moved %.2f mm, bound %.2f mm. %s\n", room,
                t, 1000 * error.metres, error.degrees, 1000 * moved,
                1000 * result->verdict.judged_bound, result->verdict.reason.c_str());
  }
  EXPECT_EQ(accurate, kTrials);
  EXPECT_EQ(registered, kTrials);
  EXPECT_EQ(wrongly_registered, 0);
  EXPECT_EQ(bound_holds, kTrials);
}

INSTANTIATE_TEST_SUITE_P(Seeds, FurnishedRooms, testing::Range(0U, 6U));

TEST(Register, CorridorIsRefusedAlongItsAxis) {
  parallel::Serial serial;
  const BoxScene scene = Corridor();
  const auto model = ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 3);
  const Eigen::Isometry3d truth = PoseAt({1.5, 0.2, 1.4}, 0.4);
  const sensor::Scan scan = ScanScene(scene, truth, {}, 4);
  sensor::PosePrior prior;
  prior.T_world_scan = truth;
  prior.T_world_scan.translation().x() += 0.2;
  const auto result = Register(*model, scan, prior, {}, serial);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->verdict.registered());
  EXPECT_EQ(result->verdict.weakest_words, "sliding along x");
  EXPECT_FALSE(result->verdict.reason.empty());
  EXPECT_FALSE(result->verdict.remedy.empty());
  // What is constrained is right all the same.
  EXPECT_NEAR(result->T_world_scan.translation().y(), 0.2, 0.003);
  EXPECT_NEAR(result->T_world_scan.translation().z(), 1.4, 0.003);
}

// Ten along each wall of a corridor, half a metre wide.
BoxScene CorridorWithPilasters(double depth) {
  BoxScene scene = Corridor();
  const Eigen::Vector3d low = scene.room.min();
  const Eigen::Vector3d high = scene.room.max();
  bool left = false;
  for (const double x : {-9.1, -6.4, -4.9, -3.2, -1.1, 0.6, 2.9, 4.3, 6.8, 8.0}) {
    const double y = left ? low.y() : high.y() - depth;
    scene.solids.emplace_back(Eigen::Vector3d(x, y, low.z()),
                              Eigen::Vector3d(x + 0.5, y + depth, high.z()));
    left = !left;
  }
  return scene;
}

// fn(registration, its error) for so many scans here and there along the middle of it.
template <typename Fn>
void RegisterAlong(const BoxScene& scene, const model::PlanningView& model, unsigned scans,
                   Fn&& fn) {
  parallel::ThreadPool pool(2);
  std::mt19937_64 random(7);
  for (unsigned trial = 0; trial < scans; ++trial) {
    SCOPED_TRACE(trial);
    const Eigen::Isometry3d truth = PoseAt({0.9 + 0.15 * trial, 0.1, 1.4}, 0.8 * trial);
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(truth, 0.2, sensor::Radians(5), random);
    const auto result = Register(model, ScanScene(scene, truth, {}, 40 + trial), prior, {}, pool);
    ASSERT_TRUE(result.ok()) << result.status();
    fn(*result, ErrorOf(result->T_world_scan, truth));
  }
}

void ExpectRegistered(const RegistrationResult& result, const PoseError& error) {
  EXPECT_LT(error.metres, 0.003) << result.verdict.reason;
  EXPECT_LT(error.degrees, 0.05);
  EXPECT_TRUE(result.verdict.registered()) << result.verdict.reason;
}

TEST(Register, PilastersHoldAScanAlongACorridor) {
  const BoxScene scene = CorridorWithPilasters(0.30);
  RegisterAlong(scene, *ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 3), 4, ExpectRegistered);
}

// Two voxels deep: enough where the model has their sides as they are.
TEST(Register, ShallowPilastersHoldAScanAlongACorridor) {
  const BoxScene scene = CorridorWithPilasters(0.10);
  const auto model = ModelOf(scene, PoseAt({0, 0, 1.4}, 0), {}, sensor::Radians(2), 3);
  RegisterAlong(scene, *model, 8, ExpectRegistered);
}

// A scan's model blurs such sides into the wall: then it is not known where along it the scan
// belongs, and the verdict says so.
TEST(Register, ShallowPilastersThatAScanBlursHoldNothing) {
  const BoxScene scene = CorridorWithPilasters(0.10);
  int refused = 0;
  RegisterAlong(scene, *ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 3), 4,
                [&](const RegistrationResult& result, const PoseError& error) {
                  refused += result.verdict.registered() ? 0 : 1;
                  EXPECT_TRUE(!result.verdict.registered() || error.metres < 0.003) << error.metres;
                  EXPECT_LT(error.metres, 0.02);
                  EXPECT_LT(error.degrees, 0.05);
                });
  EXPECT_GT(refused, 0);
}

TEST(Register, AnotherRoomIsNotAccepted) {
  parallel::Serial serial;
  const auto model = ModelFromScan(FurnishedRoom(1), PoseAt({0, 0, 1.4}, 0), {}, 5);
  BoxScene other = FurnishedRoom(9);
  other.room =
      Eigen::AlignedBox3d(Eigen::Vector3d(-1.7, -3.4, -0.4), Eigen::Vector3d(4.1, 1.6, 3.3));
  const sensor::Scan scan = ScanScene(other, PoseAt({0.5, 0, 1.4}, 0.2), {}, 6);
  sensor::PosePrior prior;
  prior.T_world_scan = PoseAt({0.5, 0, 1.4}, 0.2);
  const auto result = Register(*model, scan, prior, {}, serial);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_FALSE(result->verdict.registered()) << result->contradiction_share;
}

TEST(Register, MovedFurnitureDoesNotPullTheRoomAway) {
  parallel::Serial serial;
  BoxScene before = FurnishedRoom(2);
  BoxScene after = before;
  for (size_t i = 5; i < 9; ++i) after.solids[i].translate(Eigen::Vector3d(0.15, -0.1, 0));
  const auto model = ModelFromScan(before, PoseAt({-1, -0.6, 1.4}, 0), {}, 7);
  const Eigen::Isometry3d truth = PoseAt({0.9, 0, 1.5}, 1.0);
  sensor::PosePrior prior;
  prior.T_world_scan = PoseAt({1.0, 0.1, 1.45}, 1.05);
  const auto result = Register(*model, ScanScene(after, truth, {}, 8), prior, {}, serial);
  ASSERT_TRUE(result.ok()) << result.status();
  const PoseError error = ErrorOf(result->T_world_scan, truth);
  EXPECT_LT(error.metres, 0.003);
  EXPECT_LT(error.degrees, 0.05);
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
}

TEST(Register, ContradictionShowsWhenSeenThroughWalls) {
  const BoxScene scene = FurnishedRoom(3);
  const auto model = ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 9);
  BoxScene larger = scene;
  larger.room = Eigen::AlignedBox3d(Eigen::Vector3d(-6, -5, 0), Eigen::Vector3d(6, 5, 2.7));
  parallel::Serial serial;
  const Eigen::Isometry3d truth = PoseAt({0.3, 0.2, 1.4}, 0);
  const auto share = [&](const BoxScene& seen) {
    const ScanSurface surface = SampleSurface(ScanScene(seen, truth, {}, 10), 0.05, serial);
    const SpaceAgreement a = AgreementOf(
        surface.samples, CompareSamples(*model, VoxelSearch(*model, BoxOf(surface, truth)),
                                        surface.samples, truth, serial));
    return a.contradicting / (a.contradicting + a.fitting);
  };
  EXPECT_LT(share(scene), 0.01);
  EXPECT_GT(share(larger), 0.10);
}

TEST(Register, TrustedPoseStandsUnlessTheSurfacesDisagree) {
  parallel::Serial serial;
  const BoxScene scene = FurnishedRoom(4);
  const auto model = ModelFromScan(scene, PoseAt({-1, -0.6, 1.4}, 0), {}, 11);
  const Eigen::Isometry3d truth = PoseAt({0.9, 0, 1.5}, 1.0);
  const sensor::Scan scan = ScanScene(scene, truth, {}, 12);
  sensor::PosePrior prior;
  prior.trusted = true;
  prior.T_world_scan = truth;
  prior.T_world_scan.translation().x() += 0.002;
  prior.covariance = sensor::Matrix6d::Identity() * 4e-6;
  auto result = Register(*model, scan, prior, {}, serial);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
  EXPECT_TRUE(result->T_world_scan.isApprox(prior.T_world_scan));
  // However far off.
  for (const double off : {0.05, 0.10, 0.20, 0.35}) {
    SCOPED_TRACE(off);
    prior.T_world_scan.translation().x() = truth.translation().x() + off;
    result = Register(*model, scan, prior, {}, serial);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_FALSE(result->verdict.registered());
    EXPECT_EQ(BasesText(result->verdict.bases), "trusted pose");
  }
}

TEST(Register, SameBytesForAnyNumberOfThreads) {
  const BoxScene scene = FurnishedRoom(5);
  const auto model = ModelFromScan(scene, PoseAt({-1, -0.6, 1.4}, 0), {}, 13);
  const Eigen::Isometry3d truth = PoseAt({0.9, 0, 1.5}, 1.0);
  const sensor::Scan scan = ScanScene(scene, truth, {}, 14);
  sensor::PosePrior prior;
  prior.T_world_scan = PoseAt({1.0, 0.1, 1.45}, 1.1);
  parallel::Serial serial;
  parallel::ThreadPool pool(3);
  const auto a = Register(*model, scan, prior, {}, serial);
  const auto b = Register(*model, scan, prior, {}, pool);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->T_world_scan.matrix(), b->T_world_scan.matrix());
  EXPECT_EQ(a->covariance, b->covariance);
  EXPECT_EQ(a->verdict.error_bound, b->verdict.error_bound);
}

TEST(Register, BadInputIsNamed) {
  parallel::Serial serial;
  const BoxScene scene = BareRoom();
  const auto model = ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 15);
  sensor::Scan scan = ScanScene(scene, PoseAt({0, 0, 1.4}, 0), {}, 16);
  const model::PlanningView nothing(0.05, 0, {}, {});
  EXPECT_EQ(Register(nothing, scan, {}, {}, serial).status().code(),
            absl::StatusCode::kFailedPrecondition);
  sensor::PosePrior prior;
  prior.T_world_scan.linear() *= 1.1;
  EXPECT_EQ(Register(*model, scan, prior, {}, serial).status().code(),
            absl::StatusCode::kInvalidArgument);
  prior = {};
  prior.covariance = -sensor::Matrix6d::Identity();
  EXPECT_EQ(Register(*model, scan, prior, {}, serial).status().code(),
            absl::StatusCode::kInvalidArgument);
  scan.image.range[5] = std::nanf("");
  EXPECT_EQ(Register(*model, scan, {}, {}, serial).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace vantage::registration
