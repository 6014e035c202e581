// Ways that are too narrow, in plans of several scanners and beside claims: two rooms that lack
// density lie behind a door of 0.5 m.
#include <gtest/gtest.h>

#include <vector>

#include "core/fleet/joint_plan.h"
#include "core/fleet/pending_stations.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/planner.h"
#include "tests/support/rooms_in_a_row.h"

namespace vantage::fleet {
namespace {

using Eigen::Vector3d;

constexpr double kDoor = test_support::kRoomInARow + test_support::kWallInARow / 2;  // m, its x

class NarrowWaysBesideTest : public ::testing::Test {
 protected:
  NarrowWaysBesideTest() {
    config_.viewcell_size = 0.2;
    request_.scanners.resize(2);
  }

  JointPlan Make() {
    return MakeJointPlan(model_, request_, config_, parallel::Budget::Unlimited(), serial_,
                         [](const planning::Plan&) {})
        .value();
  }
  std::vector<planning::NarrowWay> Ways() { return Make().plan.narrow_ways; }
  planning::Plan Alone() {
    return planning::MakePlan(model_, sensor::ScannerModel(), config_,
                              parallel::Budget::Unlimited(), serial_, [](const planning::Plan&) {})
        .value();
  }
  // What a scan from there brings beyond the claims, m2, as it is summed for stations that wait.
  double Brings(const Vector3d& place, const std::vector<PledgedView>& beyond) {
    return ForecastStation(model_, sensor::ScannerModel(), config_, place, {}, beyond, serial_)
        .value()
        .model_gain;
  }
  void StandNowhereInTheFirstRoom() { config_.rejected = {{Vector3d(1.5, 1.5, 0), 2.2}}; }

  const model::PlanningView model_ = test_support::BuildView(test_support::RoomsInARow(0.5, 0.9));
  planning::PlanningConfig config_;
  FleetRequest request_;
  parallel::Serial serial_;
};

TEST_F(NarrowWaysBesideTest, AJointPlanSaysWhatTheScannersOwnPlansSay) {
  const planning::Plan alone = Alone();
  ASSERT_EQ(alone.narrow_ways.size(), 1u);
  const std::vector<planning::NarrowWay> ways = Ways();
  ASSERT_EQ(ways.size(), 1u);
  EXPECT_EQ(ways[0].place, alone.narrow_ways[0].place);
  EXPECT_EQ(ways[0].narrowest, alone.narrow_ways[0].narrowest);
  EXPECT_EQ(ways[0].width, alone.narrow_ways[0].width);
  EXPECT_NEAR(ways[0].gain_without_hidden, alone.narrow_ways[0].gain_without_hidden, 1e-6);
}

TEST_F(NarrowWaysBesideTest, WhatIsClaimedIsNotCounted) {
  const std::vector<planning::NarrowWay> without = Ways();
  ASSERT_EQ(without.size(), 1u);
  // Somebody else goes to the best place behind the door, with a scanner that fits through.
  request_.pledged = {{without[0].place, sensor::ScannerModel()}};
  const std::vector<planning::NarrowWay> beside = Ways();
  ASSERT_EQ(beside.size(), 1u);
  EXPECT_NEAR(beside[0].model_gain, Brings(beside[0].place, request_.pledged), 1e-3);
  EXPECT_LT(beside[0].model_gain, Brings(beside[0].place, {}) - 0.5);
  EXPECT_LT(beside[0].gain_without_hidden, without[0].gain_without_hidden - 1);
  // And to what is left there, until nothing is worth the trouble.
  size_t claims = 1;
  for (auto ways = beside; !ways.empty() && claims < 12; ways = Ways(), ++claims) {
    request_.pledged.push_back({ways[0].place, sensor::ScannerModel()});
  }
  EXPECT_GT(claims, 1u);
  EXPECT_LT(claims, 12u);
}

TEST_F(NarrowWaysBesideTest, ItIsSaidWhereNobodyCanGoAnywhere) {
  StandNowhereInTheFirstRoom();
  JointPlan joint = Make();
  ASSERT_EQ(joint.plan.outcome, planning::PlanOutcome::kNoFeasibleView) << joint.plan.message;
  ASSERT_EQ(joint.plan.narrow_ways.size(), 1u);
  const planning::NarrowWay without = joint.plan.narrow_ways[0];
  EXPECT_GT(without.place.x(), kDoor);
  request_.pledged = {{without.place, sensor::ScannerModel()}};
  joint = Make();
  ASSERT_EQ(joint.plan.narrow_ways.size(), 1u);
  const planning::NarrowWay& beside = joint.plan.narrow_ways[0];
  EXPECT_NEAR(beside.model_gain, Brings(beside.place, request_.pledged), 1e-3);
  EXPECT_LT(beside.gain_without_hidden, without.gain_without_hidden - 1);
}

// Scanners of two models have maps of their own, of the same doors.
TEST_F(NarrowWaysBesideTest, AWayIsSaidOnceForAllScanners) {
  request_.scanners[1].model.range_max = 10;
  EXPECT_EQ(Ways().size(), 1u);
}

// What is behind is worth saying to those who may go there.
TEST_F(NarrowWaysBesideTest, NobodyIsSentOutOfReach) {
  const planning::Region first(Vector3d(0, 0, 0), Vector3d(kDoor, 3, 2.5));
  const planning::Region second(Vector3d(kDoor, 0, 0), Vector3d(2 * kDoor, 3, 2.5));
  for (FleetMember& member : request_.scanners) member.reach = {first};
  EXPECT_TRUE(Ways().empty());
  request_.scanners[1].reach = {first, second};
  const std::vector<planning::NarrowWay> ways = Ways();
  ASSERT_EQ(ways.size(), 1u);
  EXPECT_TRUE(second.contains(ways[0].place));
}

TEST_F(NarrowWaysBesideTest, TheSameOnAnyNumberOfThreads) {
  parallel::ThreadPool pool(3);
  parallel::Budget budget;
  budget.work_limit = 20'000'000;
  std::vector<std::vector<planning::NarrowWay>> each;
  for (parallel::Parallel* threads :
       {static_cast<parallel::Parallel*>(&serial_), static_cast<parallel::Parallel*>(&pool)}) {
    each.push_back(
        MakeJointPlan(model_, request_, config_, budget, *threads, [](const planning::Plan&) {})
            .value()
            .plan.narrow_ways);
  }
  ASSERT_EQ(each[0].size(), 1u);
  ASSERT_EQ(each[1].size(), 1u);
  EXPECT_EQ(each[0][0].place, each[1][0].place);
  EXPECT_EQ(each[0][0].gain_without_hidden, each[1][0].gain_without_hidden);
}

}  // namespace
}  // namespace vantage::fleet
