// Things that were moved between scans refuse no good scan, and excuse no wrong pose.
#include "core/registration/bound/moved_things.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/align/voxel_search.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

constexpr double kSpacing = 0.05;  // m

class MovedThingsTest : public testing::Test {
 protected:
  // Five people around a scanner, 1.2 to 1.6 m off: nobody hides another, and their heads are over
  // it, so that one or two sides of each are seen.
  static constexpr double kWide = 0.5;   // m
  static constexpr double kDeep = 0.4;   // m
  static constexpr double kTall = 1.75;  // m
  static constexpr int kPeople = 5;
  static BoxScene WithPeople(BoxScene room, const Eigen::Vector3d& around) {
    for (int i = 0; i < kPeople; ++i) {
      const double angle = 0.3 + 2 * sensor::kPi * i / kPeople;
      const Eigen::Vector3d at =
          around + (1.2 + 0.1 * i) * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
      room.solids.emplace_back(Eigen::Vector3d(at.x() - kWide / 2, at.y() - kDeep / 2, 0),
                               Eigen::Vector3d(at.x() + kWide / 2, at.y() + kDeep / 2, kTall));
    }
    return room;
  }

  MovedThings Find(const sensor::Scan& scan, const Eigen::Isometry3d& pose) {
    const ScanSurface surface = SampleSurface(scan, kSpacing, serial_);
    const std::vector<SampleAgreement> agreements = CompareSamples(
        *model_, VoxelSearch(*model_, BoxOf(surface, pose)), surface.samples, pose, serial_);
    return FindMovedThings(*model_, scan, surface, kSpacing, pose, surface.samples, agreements,
                           serial_);
  }

  parallel::Serial serial_;
  const BoxScene room_ = FurnishedRoom(5);
  const Eigen::Isometry3d truth_ = PoseAt({0.4, -0.2, 1.5}, 2.5);
  const std::shared_ptr<const model::PlanningView> model_ =
      ModelFromScan(room_, PoseAt({-1, -0.6, 1.4}, 0), {}, 35);
};

TEST_F(MovedThingsTest, PeopleWhoCameRefuseNoScan) {
  const sensor::Scan scan = ScanScene(WithPeople(room_, truth_.translation()), truth_, {}, 36);
  std::mt19937_64 random(1);
  for (int t = 0; t < test_support::Runs(3); ++t) {
    sensor::PosePrior prior;
    prior.T_world_scan = Disturbed(truth_, 0.1, sensor::Radians(3), random);
    const auto result = Register(*model_, scan, prior, {}, serial_);
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result->verdict.registered()) << result->verdict.reason;
    EXPECT_LT((result->T_world_scan.translation() - truth_.translation()).norm(), 0.005);
    EXPECT_GT(result->contradiction_share, 0.08) << "else nothing is told apart";
    ASSERT_TRUE(result->moved_area.has_value());
    // One narrow side of each at least, and at most both; less what no space was known around. The
    // samples that stand for the rest are balanced over directions, so that it is a rough figure.
    constexpr double kRough = 0.25;
    EXPECT_GT(*result->moved_area, (1 - kRough) * kPeople * kDeep * kTall);
    EXPECT_LT(*result->moved_area, (1 + kRough) * kPeople * (kWide + kDeep) * kTall);
  }
}

TEST_F(MovedThingsTest, WhoCameHidesAndIsNotSeenThrough) {
  const sensor::Scan scan = ScanScene(WithPeople(room_, truth_.translation()), truth_, {}, 36);
  const MovedThings moved = Find(scan, truth_);
  EXPECT_LT(moved.seen_through, 0.001 * moved.seen_again);
  EXPECT_GT(moved.seen_again, 10);
  EXPECT_TRUE(moved.Explain());
}

TEST_F(MovedThingsTest, AtAWrongPoseFurnitureIsGone) {
  const sensor::Scan scan = ScanScene(room_, truth_, {}, 36);
  ASSERT_TRUE(Find(scan, truth_).Explain());
  // Walls and floor fit as they did: the room, turned by half about its middle.
  Eigen::Isometry3d half = Eigen::Isometry3d::Identity();
  half.linear() = Eigen::AngleAxisd(sensor::kPi, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const MovedThings wrong = Find(scan, half * truth_);
  EXPECT_GT(wrong.seen_through, 0.04 * wrong.seen_again);
  EXPECT_FALSE(wrong.Explain());
}

TEST_F(MovedThingsTest, LittleThatIsSeenAgainExplainsNothing) {
  MovedThings moved;
  moved.contradicting = 5;
  moved.seen_again = 2;
  EXPECT_FALSE(moved.Explain());
  moved.seen_again = 20;
  EXPECT_TRUE(moved.Explain());
  moved.missed_share = 0.11;
  EXPECT_FALSE(moved.Explain());
  moved.missed_share = 0;
  moved.seen_through = 1;
  EXPECT_FALSE(moved.Explain());
}

// A scan of a room that nobody has entered may lie on a known one, by things that were moved. Where
// it has its place beside that, with nothing moved and more of what is known seen again, that is
// it.
TEST_F(MovedThingsTest, WhereNothingWasMovedSaysMore) {
  const sensor::Scan scan = ScanScene(room_, truth_, {}, 36);
  const MovedThings still = Find(scan, truth_);
  MovedThings moved;
  moved.contradicting = 4;
  moved.seen_again = still.seen_again / 2;
  ASSERT_TRUE(moved.Explain());
  EXPECT_TRUE(still.SayMoreThan(moved));
  // As in the next bay of a site that repeats itself.
  moved.seen_again = 0.9 * still.seen_again;
  EXPECT_FALSE(still.SayMoreThan(moved));
  moved.seen_again = still.seen_again / 2;
  // Where people came, who may have come to either place.
  const MovedThings people =
      Find(ScanScene(WithPeople(room_, truth_.translation()), truth_, {}, 36), truth_);
  EXPECT_FALSE(people.SayMoreThan(moved));
  for (const auto against : {&MovedThings::contradicting, &MovedThings::seen_through}) {
    MovedThings other = still;
    other.*against = 0.01 * still.seen_again;
    EXPECT_FALSE(other.SayMoreThan(moved));
  }
  MovedThings other = still;
  other.missed_share = 0.03;
  EXPECT_FALSE(other.SayMoreThan(moved));
}

}  // namespace
}  // namespace vantage::registration
