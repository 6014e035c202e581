// Claims and joint plans of scanners that see a sector: only what a scan shows is taken from
// others.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/fleet/claim_cover.h"
#include "core/fleet/joint_plan.h"
#include "core/fleet/remaining_gain.h"
#include "core/parallel/thread_pool.h"
#include "core/planning/planner.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/planning_problem.h"
#include "tests/support/sector_oracle.h"

namespace vantage::fleet {
namespace {

class SectorFleetTest : public ::testing::Test {
 protected:
  static sensor::ScannerModel Scanner() {
    sensor::ScannerModel scanner;
    scanner.azimuth_span = sensor::Radians(110);
    return scanner;
  }
  static planning::PlanningConfig Config() {
    planning::PlanningConfig config;
    config.viewcell_size = 0.3;
    return config;
  }
  test_support::PlanningProblem problem_{
      std::make_shared<model::PlanningView>(
          test_support::BuildView(test_support::FurnishedRoom(4))),
      Config(), Scanner()};
  parallel::Serial serial_;
};

TEST_F(SectorFleetTest, AClaimCoversWhatItsSectorSees) {
  const Eigen::Vector3d place = problem_.views[problem_.views.size() / 2];
  const std::vector<PledgedView> claims = {{place, Scanner(), 1.0}};
  const auto cover = [&](double heading) {
    return MeasureCover(*problem_.model, Scanner(), Config(), place, claims, serial_, heading)
        .value();
  };
  EXPECT_NEAR(cover(1.0).cover.together, 1, 1e-6);
  // Half a turn on the sectors have nothing in common.
  EXPECT_EQ(cover(1.0 + sensor::kPi).cover.together, 0);
  EXPECT_GT(cover(1.0 + sensor::kPi).left, 0);
  const double beside = cover(1.0 + sensor::Radians(55)).cover.together;
  EXPECT_GT(beside, 0.05);
  EXPECT_LT(beside, 0.95);
  EXPECT_EQ(MeasureCover(*problem_.model, Scanner(), Config(), place, claims, serial_, std::nan(""))
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(SectorFleetTest, EachScannerFacesWhatTheOthersLeave) {
  FleetRequest request;
  request.scanners.resize(2);
  for (FleetMember& member : request.scanners) member.model = Scanner();
  const JointPlan joint =
      MakeJointPlan(*problem_.model, request, Config(), parallel::Budget::Unlimited(), serial_,
                    [](const planning::Plan&) {})
          .value();
  ASSERT_EQ(joint.plan.views.size(), 2u) << joint.plan.message;
  RemainingGain remaining(problem_.scoring->cells());
  uint64_t rays = 0;
  for (const planning::RankedView& view : joint.plan.views) {
    ASSERT_TRUE(view.heading.has_value());
    EXPECT_TRUE(view.verdict.registered());
    const std::vector<double> heading = {*view.heading};
    const test_support::SectorScore oracle = test_support::ScoreInSectors(
        problem_.scoring->scorer(), remaining.left(), view.position, heading)[0];
    EXPECT_GE(view.score, oracle.least * (1 - 1e-6));
    EXPECT_LE(view.score, oracle.most * (1 + 1e-6));
    EXPECT_GT(view.score, 0);
    ASSERT_TRUE(remaining.Take(view.position, problem_.scoring->scorer(),
                               parallel::Budget::Unlimited(), rays, view.heading));
  }
  // The first is the best of all views with the headings that register, as a plan for one says that
  // passes over no neighbour of a view it checked.
  planning::PlanningConfig thorough = Config();
  thorough.candidate_separation = 0;
  thorough.max_checked = 100'000;
  const auto whole =
      planning::PlanningProblem::Prepare({*problem_.model, Scanner(), thorough}, serial_).value();
  const planning::Plan alone = planning::MakePlan(*whole, parallel::Budget::Unlimited(), serial_,
                                                  [](const planning::Plan&) {});
  EXPECT_NEAR(joint.plan.views[0].score, alone.views[0].score, 1e-6 * alone.views[0].score);

  // Around a claim of the first view and heading the plan for one gains what the second did.
  FleetRequest around;
  around.scanners.resize(1);
  around.scanners[0].model = Scanner();
  around.pledged.push_back({joint.plan.views[0].position, Scanner(), joint.plan.views[0].heading});
  const JointPlan second =
      MakeJointPlan(*problem_.model, around, Config(), parallel::Budget::Unlimited(), serial_,
                    [](const planning::Plan&) {})
          .value();
  ASSERT_FALSE(second.plan.views.empty());
  EXPECT_NEAR(second.plan.views[0].score, joint.plan.views[1].score,
              1e-6 * joint.plan.views[1].score);
  parallel::ThreadPool pool(3);
  const JointPlan again =
      MakeJointPlan(*problem_.model, request, Config(), parallel::Budget::Unlimited(), pool,
                    [](const planning::Plan&) {})
          .value();
  for (size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(again.plan.views[k].position, joint.plan.views[k].position);
    EXPECT_EQ(again.plan.views[k].heading, joint.plan.views[k].heading);
  }
}

}  // namespace
}  // namespace vantage::fleet
