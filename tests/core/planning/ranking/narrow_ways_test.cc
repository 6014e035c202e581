// Rooms in a row, given as formulas, behind doorways that may be too narrow.
#include "core/planning/ranking/narrow_ways.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/planner.h"
#include "tests/support/closed_form_view.h"

namespace vantage::planning {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kRoom = 3.0;   // m, along x
constexpr double kThick = 0.2;  // m, of walls

// Three rooms of 3 x 3 m. A station in the first, whose surface is at density; the others are known
// and lack it.
test_support::ClosedFormScene Rooms(double first_door, double second_door) {
  test_support::ClosedFormScene scene;
  const double length = 3 * kRoom + 2 * kThick;
  scene.extent = Region(Vector3d(-0.1, -0.1, -0.1), Vector3d(length + 0.1, 3.1, 2.6));
  scene.solid = [=](const Vector3d& p) {
    if (p.x() < 0 || p.x() > length || p.y() < 0 || p.y() > 3 || p.z() < 0 || p.z() > 2.5) {
      return true;
    }
    const auto wall = [&](double from, double door) {
      return p.x() > from && p.x() < from + kThick &&
             (std::abs(p.y() - 1.5) > door / 2 || p.z() > 2);
    };
    return wall(kRoom, first_door) || wall(2 * kRoom + kThick, second_door);
  };
  scene.density = [](const Vector3d& p) { return p.x() < kRoom + 0.05 ? 5000 : 100; };
  scene.stations = {test_support::MakeStation(Vector3d(1.5, 1.5, 1.5))};
  return scene;
}

class NarrowWaysTest : public ::testing::Test {
 protected:
  std::shared_ptr<const PlanningProblem> Prepare(const model::PlanningView& view) {
    return PlanningProblem::Prepare({view, scanner_, config_}, serial_).value();
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
    const model::PlanningView view = test_support::BuildView(Rooms(first, second));
    EXPECT_NEAR(WidestTo(view, {4.7, 1.5, 1.5}), std::min(first, 0.6), 0.1001) << first;
    EXPECT_NEAR(WidestTo(view, {7.9, 1.5, 1.5}), std::min({first, second, 0.6}), 0.1001) << second;
    EXPECT_LE(WidestTo(view, {7.9, 1.5, 1.5}), std::min(first, second) + 1e-6);
  }
}

TEST_F(NarrowWaysTest, TheWidthThatIsSaidIsOneThatDoes) {
  const model::PlanningView view = test_support::BuildView(Rooms(0.5, 0.9));
  const auto problem = Prepare(view);
  const NarrowWays found = FindNarrowWays(*problem, 0, 0, parallel::Budget::Unlimited(), serial_);
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
  const model::PlanningView view = test_support::BuildView(Rooms(0.9, 0.9));
  const NarrowWays found =
      FindNarrowWays(*Prepare(view), 0, 0, parallel::Budget::Unlimited(), serial_);
  EXPECT_TRUE(found.ways.empty());
  EXPECT_EQ(found.rays, 0u);
}

TEST_F(NarrowWaysTest, LessThanTwiceTheBestViewIsNotWorthSaying) {
  const model::PlanningView view = test_support::BuildView(Rooms(0.5, 0.9));
  const auto problem = Prepare(view);
  const auto with = [&](double best) {
    return FindNarrowWays(*problem, best, 0, parallel::Budget::Unlimited(), serial_).ways.size();
  };
  const double gain = FindNarrowWays(*problem, 0, 0, parallel::Budget::Unlimited(), serial_)
                          .ways[0]
                          .gain_without_hidden;
  EXPECT_EQ(with(0.49 * gain), 1u);
  EXPECT_EQ(with(0.51 * gain), 0u);
  config_.terminate_below = gain + 0.1;
  EXPECT_TRUE(
      FindNarrowWays(*Prepare(view), 0, 0, parallel::Budget::Unlimited(), serial_).ways.empty());
}

TEST_F(NarrowWaysTest, APlanSaysSo) {
  config_.viewcell_size = 0.1;
  const model::PlanningView view = test_support::BuildView(Rooms(0.5, 0.9));
  const Plan plan =
      MakePlan(view, scanner_, config_, parallel::Budget::Unlimited(), serial_, [](const Plan&) {
      }).value();
  ASSERT_EQ(plan.narrow_ways.size(), 1u);
  EXPECT_GT(plan.narrow_ways[0].gain_without_hidden,
            2 * plan.termination.best_gain_without_hidden.value());
  // Nothing is expected here that is not known.
  EXPECT_NEAR(plan.narrow_ways[0].model_gain, plan.narrow_ways[0].gain_without_hidden, 1e-4);
  EXPECT_THAT(NarrowWayWords(plan.narrow_ways[0], Vector3d(100, 0, 0)),
              HasSubstr("if you can carry it through"));
}

}  // namespace
}  // namespace vantage::planning
