// Doors that have to stay open, by what scans with the door shut come to.
#include "core/planning/ranking/open_doors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "core/registration/registration.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;
using registration::BoxScene;

const registration::ScanSettings kDoorSettings{
    sensor::Radians(0.3), 0.003, sensor::Radians(-60), {}};
constexpr double kDoorHeight = 1.4;  // m, of scanners
constexpr double kHalfDoor = 0.45;   // m

// Two rooms of 4 x 5 m and a doorway of 0.9 x 2 m between them, with a cupboard in each.
BoxScene TwoRooms(bool shut) {
  BoxScene scene;
  scene.room = {Vector3d(-4, -2.5, 0), Vector3d(4, 2.5, 2.7)};
  scene.solids = {{Vector3d(0, -2.5, 0), Vector3d(0.1, -kHalfDoor, 2.7)},
                  {Vector3d(0, kHalfDoor, 0), Vector3d(0.1, 2.5, 2.7)},
                  {Vector3d(0, -kHalfDoor, 2.0), Vector3d(0.1, kHalfDoor, 2.7)},
                  {Vector3d(-3.9, 1.2, 0), Vector3d(-2.9, 1.8, 1.6)},
                  {Vector3d(2.7, -1.9, 0), Vector3d(3.5, -1.2, 1.1)}};
  if (shut)
    scene.solids.emplace_back(Vector3d(0.03, -kHalfDoor, 0), Vector3d(0.07, kHalfDoor, 2.0));
  return scene;
}

class OpenDoorsTest : public testing::Test {
 protected:
  void StandAt(double x, double y) {
    model_ = registration::ModelFromScan(
        TwoRooms(false), registration::PoseAt({x, y, kDoorHeight}, 0), kDoorSettings, 3);
    scanner_.azimuth_step = scanner_.elevation_step = kDoorSettings.step;
    PlanningConfig config;
    config.registration.prior_sigma = 0.05;
    problem_ = PlanningProblem::Prepare({*model_, scanner_, config}, pool_).value();
  }
  RankedView View(double x, double y) const {
    RankedView view;
    view.position = {x, y, kDoorHeight};
    view.verdict = problem_->overlap()
                       .Predict(view.position, problem_->scene(), problem_->config().registration,
                                parallel::Budget::Unlimited())
                       ->verdict;
    return view;
  }
  std::vector<OpenDoor> Find(const RankedView& view) const {
    uint64_t rays = 0;
    return FindOpenDoors(*problem_, view, parallel::Budget::Unlimited(), rays);
  }
  bool Registers(const RankedView& view, bool shut) {
    const Eigen::Isometry3d truth = registration::PoseAt(view.position, 0.4);
    sensor::PosePrior prior;
    prior.T_world_scan = truth;
    prior.T_world_scan.translation().x() += 0.03;
    sensor::Vector6d sigma;
    sigma << 0.02, 0.02, 0.05, 0.05, 0.05, 0.05;
    prior.covariance = sigma.cwiseAbs2().asDiagonal();
    return registration::Register(*model_,
                                  registration::ScanScene(TwoRooms(shut), truth, kDoorSettings, 11),
                                  prior, problem_->config().registration, pool_)
        ->verdict.registered();
  }

  parallel::ThreadPool pool_{2};
  std::shared_ptr<const model::PlanningView> model_;
  sensor::ScannerModel scanner_;
  std::shared_ptr<const PlanningProblem> problem_;
};

// From the far corner little is seen of the other room, and from before the doorway most of it.
TEST_F(OpenDoorsTest, BehindADoorwayTheDoorHoldsTheScanUnlessItsRoomDoes) {
  int depend = 0;
  int stand = 0;
  int refused = 0;
  for (const Vector3d& station : {Vector3d(-3.4, -2.0, 0), Vector3d(-1.2, 0.3, 0)}) {
    StandAt(station.x(), station.y());
    for (const double x : {0.6, 1.0, 1.5}) {
      for (const double y : {-0.5, 0.0, 0.4}) {
        const RankedView view = View(x, y);
        if (!view.verdict.registered()) {
          EXPECT_TRUE(Find(view).empty());
          continue;
        }
        const std::vector<OpenDoor> doors = Find(view);
        if (doors.empty()) {
          ++stand;
          EXPECT_TRUE(Registers(view, true)) << "at " << x << ", " << y;
          continue;
        }
        ++depend;
        ASSERT_EQ(doors.size(), 1u);
        EXPECT_NEAR(doors[0].centre.x(), 0.05, 0.15);
        EXPECT_NEAR(doors[0].centre.y(), 0, 0.1);
        EXPECT_NEAR(doors[0].width, 2 * kHalfDoor, 0.15);
        EXPECT_GT(doors[0].overlap_share, 0.1);
        EXPECT_LE(doors[0].overlap_share, 1.0);
        EXPECT_TRUE(Registers(view, false)) << "at " << x << ", " << y;
        refused += Registers(view, true) ? 0 : 1;
      }
    }
  }
  EXPECT_GE(depend, 2);
  EXPECT_GE(stand, 5);
  // A prediction keeps a margin, so that some would register all the same.
  EXPECT_GE(refused, depend / 2);
}

TEST_F(OpenDoorsTest, BesideTheStationNoneMatters) {
  StandAt(-1.2, 0.3);
  for (const double x : {-2.2, -0.6}) EXPECT_TRUE(Find(View(x, -0.8)).empty()) << x;
}

}  // namespace
}  // namespace vantage::planning
