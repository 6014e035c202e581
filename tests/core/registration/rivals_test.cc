// Sites that repeat themselves, and priors that are wrong by metres.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include "core/parallel/thread_pool.h"
#include "core/registration/align/align.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/bound/rivals.h"
#include "core/registration/registration.h"
#include "core/sensor/scanner_model.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

constexpr double kBay = 2.5;  // m

// A corridor that ends out of range, with pillars that are 0.3 m deep.
BoxScene RegularCorridor() {
  BoxScene scene = Corridor();
  const Eigen::Vector3d low = scene.room.min();
  const Eigen::Vector3d high = scene.room.max();
  for (double x = low.x() + 1; x < high.x() - 1; x += kBay) {
    scene.solids.emplace_back(Eigen::Vector3d(x, low.y(), low.z()),
                              Eigen::Vector3d(x + 0.4, low.y() + 0.3, high.z()));
    scene.solids.emplace_back(Eigen::Vector3d(x, high.y() - 0.3, low.z()),
                              Eigen::Vector3d(x + 0.4, high.y(), high.z()));
  }
  return scene;
}

sensor::PosePrior PriorAt(const Eigen::Isometry3d& truth, const Eigen::Vector3d& off,
                          double sigma) {
  sensor::PosePrior prior;
  prior.T_world_scan = truth;
  prior.T_world_scan.pretranslate(off);
  const double turn = sensor::Radians(3);
  const double tilt = sensor::Radians(1);
  prior.covariance =
      sensor::Vector6d{{tilt, tilt, turn, sigma, sigma, 0.05}}.cwiseAbs2().asDiagonal();
  return prior;
}

// A scan in the corridor's second bay, and a model of its first.
class RivalsInACorridor : public testing::Test {
 protected:
  absl::StatusOr<RegistrationResult> RegisterFrom(const Eigen::Vector3d& off, double sigma) {
    return Register(*model_, scan_, PriorAt(truth_, off, sigma), {}, pool_);
  }
  double Error(const RegistrationResult& result) const {
    return (result.T_world_scan.translation() - Truth()).norm();
  }
  Eigen::Vector3d Truth() const { return truth_.translation(); }

 private:
  parallel::ThreadPool pool_{2};
  const BoxScene scene_ = RegularCorridor();
  const std::shared_ptr<const model::PlanningView> model_ =
      ModelFromScan(scene_, PoseAt({0, 0, 1.4}, 0), {}, 3);
  const Eigen::Isometry3d truth_ = PoseAt({3, 0.1, 1.4}, 0.8);
  const sensor::Scan scan_ = ScanScene(scene_, truth_, {}, 4);
};

TEST_F(RivalsInACorridor, WhereAPriorAllowsAnotherBayThatIsAlikeAScanIsInDoubt) {
  for (const double off : {-kBay, 0.0, 1.0}) {
    SCOPED_TRACE(off);
    const auto result = RegisterFrom({off, 0, 0}, 1);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful);
    EXPECT_THAT(result->verdict.bases, testing::ElementsAre(RegistrationBasis::kRivalPose));
    // Whichever pose was taken, the bound holds for the right one, and that is among those named.
    EXPECT_GT(result->verdict.error_bound, std::max(0.9 * kBay, Error(*result)));
    EXPECT_GE(result->verdict.rigorous_bound, result->verdict.error_bound);
    double nearest = Error(*result);
    for (const RivalPose& rival : result->rival_poses) {
      nearest = std::min(nearest, (rival.T_world_scan.translation() - Truth()).norm());
    }
    EXPECT_LT(nearest, 0.003);
  }
}

// Nine bays and more lie within the prior's reach; those that the model does not refute are named.
TEST_F(RivalsInACorridor, HoweverManyBaysAPriorAllowsTheRightOneIsNamedAndSpanned) {
  for (const double off : {-3 * kBay, -1.0, 4 * kBay}) {
    SCOPED_TRACE(off);
    const auto result = RegisterFrom({off, 0, 0}, 5);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->verdict.outcome, RegistrationOutcome::kDoubtful);
    EXPECT_THAT(result->verdict.bases, testing::ElementsAre(RegistrationBasis::kRivalPose));
    EXPECT_GT(result->rival_poses.size(), 2U);
    EXPECT_THAT(result->verdict.reason,
                testing::HasSubstr(
                    absl::StrFormat("and so do %d more, up to ", result->rival_poses.size() - 1)));
    EXPECT_GT(result->verdict.error_bound, Error(*result));
    double nearest = Error(*result);
    double farthest = 0;
    for (const RivalPose& rival : result->rival_poses) {
      nearest = std::min(nearest, (rival.T_world_scan.translation() - Truth()).norm());
      farthest = std::max(farthest, rival.distance);
    }
    EXPECT_LT(nearest, 0.003) << result->verdict.reason;
    EXPECT_GE(result->verdict.error_bound, farthest);
  }
}

// Minima that alignments find with some of the samples.
class NearRivals : public testing::Test {
 protected:
  // The rivals that are left of one that lies `off` from where a scan of `scene` belongs.
  size_t LeftOf(const BoxScene& scene, const Eigen::Vector3d& off) {
    const auto model = ModelFromScan(scene, PoseAt({0, 0, 1.4}, 0), {}, 3);
    const Eigen::Isometry3d truth = PoseAt({0.4, 0.1, 1.4}, 0.8);
    const ScanSurface surface = SampleSurface(ScanScene(scene, truth, {}, 4), 0.05, pool_);
    Alignment alignment;
    alignment.T_world_scan = truth;
    alignment.score = 100;
    Minimum rival;
    rival.T_world_scan = truth;
    rival.T_world_scan.pretranslate(off);
    rival.score = 90;
    alignment.rivals.push_back(rival);
    LeaveOutWhatEndsAtTheBest(*model, surface, {}, pool_, alignment);
    return alignment.rivals.size();
  }
  parallel::ThreadPool pool_{2};
};

TEST_F(NearRivals, WhatAllSamplesLeadToWhereTheScanIsIsNone) {
  EXPECT_EQ(LeftOf(FurnishedRoom(1), {0.1, 0.05, 0}), 0U);
}

// Ribs on both walls, half a metre apart: half a metre on all fits as well.
TEST_F(NearRivals, ATwinHalfAMetreOffIsOne) {
  BoxScene ribs = Corridor();
  for (double x = -10; x < 10; x += 0.5) {
    ribs.solids.emplace_back(Eigen::Vector3d(x, ribs.room.min().y(), 0),
                             Eigen::Vector3d(x + 0.2, ribs.room.min().y() + 0.2, 2.7));
    ribs.solids.emplace_back(Eigen::Vector3d(x, ribs.room.max().y() - 0.2, 0),
                             Eigen::Vector3d(x + 0.2, ribs.room.max().y(), 2.7));
  }
  EXPECT_EQ(LeftOf(ribs, {0.5, 0, 0}), 1U);
  EXPECT_EQ(LeftOf(ribs, {0, 0, 0}), 0U);
}

// Nothing holds a scan along a bare corridor: it stays wherever it is put.
TEST_F(NearRivals, WhatNothingLeadsBackIsOne) { EXPECT_EQ(LeftOf(Corridor(), {0.3, 0, 0}), 1U); }

TEST_F(RivalsInACorridor, APriorThatExcludesOtherBaysDecides) {
  const auto result = RegisterFrom({0.3, -0.2, 0}, 0.3);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
  EXPECT_TRUE(result->rival_poses.empty());
  EXPECT_LT(Error(*result), 0.003);
}

TEST(Rivals, APriorThatMayBeMetresOffFindsTheOnlyPlace) {
  parallel::ThreadPool pool(2);
  const BoxScene scene = FurnishedRoom(2);
  const auto model = ModelFromScan(scene, PoseAt({-0.6, 0.3, 1.4}, 0), {}, 5);
  const Eigen::Isometry3d truth = PoseAt({0.5, -0.2, 1.45}, 0.6);
  const sensor::Scan scan = ScanScene(scene, truth, {}, 6);
  for (const Eigen::Vector3d& off :
       {Eigen::Vector3d(2.5, 0, 0), Eigen::Vector3d(-2, 3, 0.05), Eigen::Vector3d(0, -4, 0)}) {
    SCOPED_TRACE(off.transpose());
    const auto result = Register(*model, scan, PriorAt(truth, off, 2), {}, pool);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.003);
  }
}

// The prior says 15 cm and is nearly 2 m off, in a place that the scan contradicts.
TEST(Rivals, APriorThatIsMuchWorseThanItSaysIsFoundOut) {
  parallel::ThreadPool pool(2);
  const BoxScene scene = FurnishedRoom(2);
  const auto model = ModelFromScan(scene, PoseAt({-0.6, 0.3, 1.4}, 0), {}, 5);
  const Eigen::Isometry3d truth = PoseAt({0.5, -0.2, 1.45}, 0.6);
  const sensor::Scan scan = ScanScene(scene, truth, {}, 6);
  for (const Eigen::Vector3d& off : {Eigen::Vector3d(1.6, 0.7, 0), Eigen::Vector3d(-1.5, 1.2, 0)}) {
    SCOPED_TRACE(off.transpose());
    const auto result = Register(*model, scan, PriorAt(truth, off, 0.15), {}, pool);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(),
              result->verdict.error_bound);
    EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.003)
        << result->verdict.reason;
  }
}

// A caller may state any covariance.
TEST(Rivals, APriorThatKnowsNothingIsAnswered) {
  parallel::ThreadPool pool(2);
  const BoxScene scene = FurnishedRoom(2);
  const auto model = ModelFromScan(scene, PoseAt({-0.6, 0.3, 1.4}, 0), {}, 5);
  const Eigen::Isometry3d truth = PoseAt({0.5, -0.2, 1.45}, 0.6);
  const sensor::Scan scan = ScanScene(scene, truth, {}, 6);
  for (const double sigma : {1e4, 1e100}) {
    sensor::PosePrior prior = PriorAt(truth, {1, 2, 0.1}, sigma);
    (*prior.covariance)(2, 2) = (*prior.covariance)(5, 5) = sigma * sigma;
    const auto result = Register(*model, scan, prior, {}, pool);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_TRUE(result->T_world_scan.matrix().allFinite());
    if (result->verdict.registered()) {
      EXPECT_LT((result->T_world_scan.translation() - truth.translation()).norm(), 0.003);
    }
  }
}

}  // namespace
}  // namespace vantage::registration
