// Rooms in a row behind doorways that may be too narrow.
#include "core/planning/ranking/narrow_ways.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/planner.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/rooms_in_a_row.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;
using test_support::RoomsInARow;

constexpr double kRoom = test_support::kRoomInARow;   // m
constexpr double kThick = test_support::kWallInARow;  // m

class NarrowWaysTest : public ::testing::Test {
 protected:
  std::shared_ptr<const PlanningProblem> Prepare(const model::PlanningView& view) {
    return PlanningProblem::Prepare({view, scanner_, config_}, serial_).value();
  }
  // Beside a best view that gains so much, m2.
  NarrowWays Find(const PlanningProblem& problem, double best) {
    return FindNarrowWays({problem, problem.scoring().cells(), best}, 0,
                          parallel::Budget::Unlimited(), serial_);
  }
  Plan Make(const model::PlanningView& view,
            const parallel::Budget& budget = parallel::Budget::Unlimited()) {
    return MakePlan(view, scanner_, config_, budget, serial_, [](const Plan&) {}).value();
  }
  // The widest way to the floor under a place, m.
  double WidestTo(const model::PlanningView& view, const Vector3d& place) {
    const auto problem = Prepare(view);
    const ReachMap& reach = problem->feasible().reach();
    return static_cast<double>(
        reach.FindWidestWays(view)[reach.nodes().Under(place).value()].width);
  }

  sensor::ScannerModel scanner_;
  PlanningConfig config_;
  parallel::Serial serial_;
};

// Closed form: the narrower of the doors before it, within a voxel to either side; never more than
// the scanner's own.
TEST_F(NarrowWaysTest, TheWidestWayIsAsWideAsTheNarrowestDoorOnIt) {
  for (const auto& [first, second] : {std::pair{0.5, 0.4}, {0.4, 0.5}, {0.5, 0.9}, {0.9, 0.9}}) {
    const model::PlanningView view = test_support::BuildView(RoomsInARow(first, second));
    EXPECT_NEAR(WidestTo(view, {4.7, 1.5, 1.5}), std::min(first, 0.6), 0.1001) << first;
    EXPECT_NEAR(WidestTo(view, {7.9, 1.5, 1.5}), std::min({first, second, 0.6}), 0.1001) << second;
    EXPECT_LE(WidestTo(view, {7.9, 1.5, 1.5}), std::min(first, second) + 1e-6);
  }
}

TEST_F(NarrowWaysTest, TheWidthThatIsSaidIsOneThatDoes) {
  const model::PlanningView view = test_support::BuildView(RoomsInARow(0.5, 0.9));
  const auto problem = Prepare(view);
  const NarrowWays found = Find(*problem, 0);
  ASSERT_EQ(found.ways.size(), 1u);
  const NarrowWay& way = found.ways[0];
  EXPECT_NEAR(way.narrowest.x(), kRoom + kThick / 2, 0.3);
  EXPECT_NEAR(way.narrowest.y(), 1.5, 0.15);
  EXPECT_GE(way.width, 0.4 - 1e-6);
  EXPECT_LE(way.width, 0.5);
  EXPECT_GT(way.place.x(), kRoom + kThick);
  EXPECT_GT(found.rays, 0u);
  const FeasibleViews::CellIndex cell = problem->feasible().CellOf(way.place);
  EXPECT_EQ(problem->feasible().Why(cell), Infeasibility::kUnreachable);
  config_.scanner_width = way.width;
  EXPECT_EQ(Prepare(view)->feasible().Why(cell), Infeasibility::kNone);
  config_.scanner_width = 0.55;
  EXPECT_EQ(Prepare(view)->feasible().Why(cell), Infeasibility::kUnreachable);
}

TEST_F(NarrowWaysTest, WhatTheScannerIsCarriedToIsNone) {
  const model::PlanningView view = test_support::BuildView(RoomsInARow(0.9, 0.9));
  const NarrowWays found = Find(*Prepare(view), 0);
  EXPECT_TRUE(found.ways.empty());
  EXPECT_EQ(found.rays, 0u);
}

TEST_F(NarrowWaysTest, LessThanTwiceTheBestViewIsNotWorthSaying) {
  const model::PlanningView view = test_support::BuildView(RoomsInARow(0.5, 0.9));
  const auto problem = Prepare(view);
  const auto with = [&](double best) { return Find(*problem, best).ways.size(); };
  const double gain = Find(*problem, 0).ways[0].gain_without_hidden;
  EXPECT_EQ(with(0.49 * gain), 1u);
  EXPECT_EQ(with(0.51 * gain), 0u);
  config_.terminate_below = gain + 0.1;
  EXPECT_TRUE(Find(*Prepare(view), 0).ways.empty());
}

TEST_F(NarrowWaysTest, APlanSaysSo) {
  config_.viewcell_size = 0.1;
  const Plan plan = Make(test_support::BuildView(RoomsInARow(0.5, 0.9)));
  ASSERT_EQ(plan.narrow_ways.size(), 1u);
  EXPECT_GT(plan.narrow_ways[0].gain_without_hidden,
            2 * plan.termination.best_gain_without_hidden.value());
  // Nothing is expected here that is not known.
  EXPECT_NEAR(plan.narrow_ways[0].model_gain, plan.narrow_ways[0].gain_without_hidden, 1e-4);
}

// Somebody who may stand nowhere in the first room needs to hear of the way most of all.
TEST_F(NarrowWaysTest, APlanSaysSoWhereNoViewIsFeasible) {
  config_.viewcell_size = 0.2;
  config_.rejected = {{Vector3d(1.5, 1.5, 0), 2.2}};
  const model::PlanningView view = test_support::BuildView(RoomsInARow(0.5, 0.9));
  const Plan plan = Make(view);
  ASSERT_EQ(plan.outcome, PlanOutcome::kNoFeasibleView) << plan.message;
  ASSERT_EQ(plan.narrow_ways.size(), 1u);
  EXPECT_GT(plan.narrow_ways[0].place.x(), kRoom + kThick);
  config_.scanner_width = plan.narrow_ways[0].width;
  const Plan through = Make(view);
  EXPECT_EQ(through.outcome, PlanOutcome::kViews) << through.message;
  EXPECT_TRUE(through.narrow_ways.empty());
}

// Preparing may have taken the time. There is nothing else to say, so this is said beyond it.
TEST_F(NarrowWaysTest, APlanWithoutAViewSaysSoWhenItsTimeIsOver) {
  config_.rejected = {{Vector3d(1.5, 1.5, 0), 2.2}};
  const model::PlanningView view = test_support::BuildView(RoomsInARow(0.5, 0.9));
  EXPECT_EQ(Make(view, parallel::Budget::Seconds(0)).narrow_ways.size(), 1u);
}

TEST_F(NarrowWaysTest, APlanOfWhatIsCompleteSaysNothing) {
  test_support::ClosedFormScene complete = RoomsInARow(0.5, 0.9);
  complete.density = [](const Vector3d&) { return 5000; };
  const Plan plan = Make(test_support::BuildView(complete));
  EXPECT_EQ(plan.outcome, PlanOutcome::kNothingToGain);
  EXPECT_TRUE(plan.narrow_ways.empty());
}

// Whoever reads it sets what it names, so it is the field of the contract.
TEST(NarrowWayWordsTest, NameTheFieldToSet) {
  NarrowWay way;
  way.narrowest = Vector3d(3.1, 1.5, 0);
  way.width = 0.45;
  way.place = Vector3d(4.7, 1.4, 1.55);
  way.model_gain = way.gain_without_hidden = 5;
  EXPECT_EQ(NarrowWayWords(way, Vector3d(100, 0, 0)),
            "a scan from (104.70, 1.40, 1.55), behind the way 0.45 m wide at (103.10, 1.50), would "
            "bring 5.00 m2 to the required density: set scanner_width_m to 0.45 if you can carry "
            "it through");
  way.model_gain = 4;
  EXPECT_EQ(NarrowWayWords(way, Vector3d::Zero()),
            "a scan from (4.70, 1.40, 1.55), behind the way 0.45 m wide at (3.10, 1.50), would "
            "bring 5.00 m2 to the required density, of which 4.00 m2 are seen today: set "
            "scanner_width_m to 0.45 if you can carry it through");
}

}  // namespace
}  // namespace vantage::planning
